// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/joint_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "motion/curve/rotation_rate.h"

namespace dyop {
namespace {

using motion_internal::round_up;

using Buffer = std::array<Scalar, JointPath::kMaxDegree + 1>;

// Exactly rounded at the ends.
Scalar blend(Scalar x, Scalar y, Scalar s) {
  return (1 - s) * x + s * y;
}

// The polynomial with these Bernstein coefficients at s, by de Casteljau's algorithm.
Scalar value_at(const Scalar* b, std::size_t count, Scalar s) {
  if (count == 1) return b[0];
  Buffer x;
  std::copy_n(b, count, x.begin());
  for (std::size_t left = count - 1; left > 0; --left) {
    for (std::size_t k = 0; k < left; ++k) x[k] = blend(x[k], x[k + 1], s);
  }
  return x[0];
}

Scalar largest_size(const Scalar* b, std::size_t count) {
  Scalar largest = 0;
  for (std::size_t k = 0; k < count; ++k) largest = std::max(largest, std::abs(b[k]));
  return largest;
}

// Bounds the size of the polynomial over [s0, s1]: the largest Bernstein coefficient there. Each is
// a value of the polar form, found by inserting s0 once more.
Scalar largest_over(const Scalar* b, std::size_t count, Scalar s0, Scalar s1) {
  if (count == 0) return 0;
  Buffer filled;
  std::copy_n(b, count, filled.begin());
  Scalar largest = 0;
  for (std::size_t k = count; k-- > 0;) {
    largest = std::max(largest, std::abs(value_at(filled.data(), k + 1, s1)));
    for (std::size_t i = 0; i < k; ++i) filled[i] = blend(filled[i], filled[i + 1], s0);
  }
  // Convex combinations err relative to their inputs, not to the result.
  return round_up(largest) + kMotionNoise * largest_size(b, count);
}

JointPath::Bound join(const JointPath::Bound& x, const JointPath::Bound& y) {
  return {std::max(x.speed, y.speed), std::max(x.acceleration, y.acceleration)};
}

}  // namespace

JointPath::JointPath(std::vector<Scalar> times, std::span<const Eigen::MatrixXd> controls)
    : coordinate_count_(static_cast<std::size_t>(controls[0].rows())),
      degree_(static_cast<std::size_t>(controls[0].cols()) - 1),
      times_(std::move(times)),
      coefficients_(controls.size() * coordinate_count_ * stride()),
      piece_bounds_(controls.size() * coordinate_count_),
      largest_values_(coordinate_count_, 0) {
  for (std::size_t piece = 0; piece < controls.size(); ++piece) {
    const Scalar h = times_[piece + 1] - times_[piece];
    for (std::size_t j = 0; j < coordinate_count_; ++j) {
      Scalar* value = coefficients_.data() + (piece * coordinate_count_ + j) * stride();
      Scalar* rate = value + degree_ + 1;
      Scalar* acceleration = rate + degree_;
      for (std::size_t k = 0; k <= degree_; ++k) {
        value[k] = controls[piece](static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
      }
      const Scalar degree = static_cast<Scalar>(degree_);
      for (std::size_t k = 0; k < degree_; ++k) rate[k] = degree * (value[k + 1] - value[k]) / h;
      for (std::size_t k = 0; k + 1 < degree_; ++k) {
        acceleration[k] = (degree - 1) * (rate[k + 1] - rate[k]) / h;
      }
      const Scalar speed = largest_size(rate, degree_);
      // Differences of rates err relative to the rates.
      const Scalar noise = degree_ > 1 ? kMotionNoise * degree * speed / h : 0;
      const Bound bound{round_up(speed), round_up(largest_size(acceleration, degree_ - 1) + noise)};
      DYOP_REQUIRE(bound.speed < kInfinity && bound.acceleration < kInfinity, "coordinate ", j,
                   " of a joint path is too fast between t = ", times_[piece], " and ",
                   times_[piece + 1]);
      piece_bounds_[piece * coordinate_count_ + j] = bound;
      largest_values_[j] = std::max(largest_values_[j], largest_size(value, degree_ + 1));
    }
  }
}

std::size_t JointPath::piece_at(Scalar t) const {
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, t);
  return static_cast<std::size_t>(after - times_.begin()) - 1;
}

JointPath::Sample JointPath::sample(std::size_t coordinate, std::size_t piece, Scalar t) const {
  const Scalar begin = times_[piece];
  const Scalar s = std::clamp((t - begin) / (times_[piece + 1] - begin), 0.0, 1.0);
  const Scalar* value = row(piece, coordinate);
  return {value_at(value, degree_ + 1, s), value_at(value + degree_ + 1, degree_, s)};
}

JointPath::Bound JointPath::bound_of_piece(std::size_t coordinate, std::size_t piece,
                                           const TimeInterval& part) const {
  const Bound& whole = piece_bounds_[piece * coordinate_count_ + coordinate];
  if (degree_ == 1) return whole;
  const Scalar begin = times_[piece];
  const Scalar end = times_[piece + 1];
  if (part.begin <= begin && part.end >= end) return whole;
  // Outward: the rounding of a fraction is below kMotionNoise.
  const Scalar h = end - begin;
  const Scalar s0 = std::clamp((part.begin - begin) / h - kMotionNoise, 0.0, 1.0);
  const Scalar s1 = std::clamp((part.end - begin) / h + kMotionNoise, 0.0, 1.0);
  const Scalar* rate = row(piece, coordinate) + degree_ + 1;
  // Differences of rates err relative to the rates.
  const Scalar noise =
      whole.acceleration > 0 ? kMotionNoise * Scalar(degree_) * whole.speed / h : 0;
  return {std::min(whole.speed, largest_over(rate, degree_, s0, s1)),
          std::min(whole.acceleration, largest_over(rate + degree_, degree_ - 1, s0, s1) + noise)};
}

JointPath::Bound JointPath::bound(std::size_t coordinate, const TimeInterval& part) const {
  const std::size_t first = piece_at(part.begin);
  Bound result = bound_of_piece(coordinate, first, part);
  // A piece that starts where the part ends does not count.
  for (std::size_t piece = first + 1; piece + 1 < times_.size() && times_[piece] < part.end;
       ++piece) {
    result = join(result, bound_of_piece(coordinate, piece, part));
    result.acceleration = kInfinity;
  }
  return result;
}

Eigen::MatrixXd JointPath::controls(std::size_t piece) const {
  DYOP_REQUIRE(piece + 1 < times_.size(), "the path has ", times_.size() - 1, " pieces, no piece ",
               piece);
  Eigen::MatrixXd result(static_cast<Eigen::Index>(coordinate_count_),
                         static_cast<Eigen::Index>(degree_ + 1));
  for (std::size_t j = 0; j < coordinate_count_; ++j) {
    for (std::size_t k = 0; k <= degree_; ++k) {
      result(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k)) = row(piece, j)[k];
    }
  }
  return result;
}

JointVector JointPath::position(Scalar t) const {
  DYOP_REQUIRE(domain().contains(t), "joint path is defined only on [", times_.front(), ", ",
               times_.back(), "], not at t = ", t);
  JointVector q(coordinate_count_);
  for (std::size_t j = 0; j < coordinate_count_; ++j) {
    q[static_cast<Eigen::Index>(j)] = sample(j, piece_at(t), t).value;
  }
  return q;
}

JointVector JointPath::velocity(Scalar t) const {
  DYOP_REQUIRE(domain().contains(t), "joint path is defined only on [", times_.front(), ", ",
               times_.back(), "], not at t = ", t);
  JointVector rate(coordinate_count_);
  for (std::size_t j = 0; j < coordinate_count_; ++j) {
    rate[static_cast<Eigen::Index>(j)] = sample(j, piece_at(t), t).rate;
  }
  return rate;
}

}  // namespace dyop
