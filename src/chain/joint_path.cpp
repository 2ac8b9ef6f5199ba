// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/joint_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "chain/joint_chords.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "motion/curve/chart_curve.h"

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
  if (controls.size() >= chain_internal::JointChords::kFewest) set_chords();
}

void JointPath::set_chords() {
  const std::size_t count = times_.size() - 1;
  std::vector<Scalar> values;
  std::vector<Scalar> bows;
  for (std::size_t piece = 0; piece < count; ++piece) {
    const Scalar h = times_[piece + 1] - times_[piece];
    for (std::size_t j = 0; j < coordinate_count_; ++j) {
      values.push_back(row(piece, j)[0]);
      bows.push_back(
          round_up(piece_bounds_[piece * coordinate_count_ + j].acceleration * h * h / 8));
    }
  }
  for (std::size_t j = 0; j < coordinate_count_; ++j) {
    values.push_back(row(count - 1, j)[degree_]);
  }
  chords_ = std::make_shared<const chain_internal::JointChords>(times_, values, bows);
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

// The constructors of JointPath: each is converted to Bezier pieces.
namespace {

using Controls = std::vector<Eigen::MatrixXd>;

void require_times(std::span<const Scalar> times) {
  DYOP_REQUIRE(times.size() >= 2, "a joint path needs at least two times, not ", times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    DYOP_REQUIRE(std::isfinite(times[i]), "time ", i, " of a joint path must be finite, not ",
                 times[i]);
    DYOP_REQUIRE(i == 0 || times[i] > times[i - 1], "times of a joint path must increase, but ",
                 times[i], " follows ", times[i - 1]);
  }
}

void require_vectors(std::span<const JointVector> vectors, std::size_t count, const char* what) {
  DYOP_REQUIRE(vectors.size() == count, "a joint path with ", count, " times needs as many ", what,
               ", not ", vectors.size());
  for (std::size_t i = 0; i < count; ++i) {
    DYOP_REQUIRE(vectors[i].size() == vectors[0].size() && vectors[i].size() > 0, what, " ", i,
                 " of a joint path has ", vectors[i].size(), " coordinates, the first one has ",
                 vectors[0].size());
    DYOP_REQUIRE(vectors[i].allFinite(), what, " ", i, " of a joint path must be finite, not (",
                 vectors[i].transpose(), ")");
  }
}

void require_knots(std::size_t degree, std::span<const Scalar> knots, std::size_t point_count) {
  DYOP_REQUIRE(degree >= 1 && degree <= JointPath::kMaxDegree,
               "degree of a joint path must be 1 to ", JointPath::kMaxDegree, ", not ", degree);
  DYOP_REQUIRE(point_count > degree && knots.size() == point_count + degree + 1,
               "a B-spline of degree ", degree, " needs at least ", degree + 1,
               " control points and ", degree + 1, " more knots than these, not ", point_count,
               " and ", knots.size());
  for (std::size_t i = 0; i < knots.size(); ++i) {
    DYOP_REQUIRE(std::isfinite(knots[i]), "knot ", i, " of a joint path must be finite, not ",
                 knots[i]);
    DYOP_REQUIRE(i == 0 || knots[i] >= knots[i - 1],
                 "knots of a joint path must not decrease, but ", knots[i], " follows ",
                 knots[i - 1]);
    // degree + 1 equal knots inside the domain would break the path.
    DYOP_REQUIRE(i <= degree || i >= point_count || knots[i] > knots[i - degree], "knot ", i, " = ",
                 knots[i], " of a B-spline of degree ", degree, " occurs more than ", degree,
                 " times");
  }
  DYOP_REQUIRE(knots[degree] < knots[point_count],
               "domain of a joint path must have a positive length, not [", knots[degree], ", ",
               knots[point_count], "]");
}

// The polar form of the spline on the span from knot i, with knot i + 1 `count` times and otherwise
// knot i: de Boor's algorithm with a different argument at every level.
JointVector polar_form(std::size_t degree, std::span<const Scalar> knots,
                       std::span<const JointVector> points, std::size_t i, std::size_t count) {
  std::vector<JointVector> x(points.begin() + std::ptrdiff_t(i - degree),
                             points.begin() + std::ptrdiff_t(i + 1));
  for (std::size_t level = 1; level <= degree; ++level) {
    const Scalar u = knots[level <= count ? i + 1 : i];
    for (std::size_t k = degree; k >= level; --k) {
      const Scalar low = knots[i - degree + k];
      const Scalar high = knots[i + 1 + k - level];
      const Scalar s = (u - low) / (high - low);
      x[k] = (1 - s) * x[k - 1] + s * x[k];
    }
  }
  return x[degree];
}

// Velocities of the cubic spline that rests at both ends: the tridiagonal system of continuous
// accelerations, which is diagonally dominant, by elimination without pivoting.
std::vector<JointVector> spline_velocities(std::span<const Scalar> times,
                                           std::span<const JointVector> points) {
  const std::size_t count = times.size();
  std::vector<JointVector> velocity(count, JointVector::Zero(points[0].size()));
  std::vector<Scalar> upper(count, 0);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const Scalar before = times[i] - times[i - 1];
    const Scalar after = times[i + 1] - times[i];
    // after v(i-1) + 2 (before + after) v(i) + before v(i+1)
    //     = 3 (after slope before i + before slope after i)
    const Scalar pivot = 2 * (before + after) - after * upper[i - 1];
    upper[i] = before / pivot;
    const JointVector right = 3 * (after / before * (points[i] - points[i - 1]) +
                                   before / after * (points[i + 1] - points[i]));
    velocity[i] = (right - after * velocity[i - 1]) / pivot;
  }
  for (std::size_t i = count - 1; i-- > 1;) velocity[i] -= upper[i] * velocity[i + 1];
  return velocity;
}

}  // namespace

JointPath JointPath::bezier(std::span<const Scalar> times,
                            std::span<const Eigen::MatrixXd> controls) {
  require_times(times);
  DYOP_REQUIRE(controls.size() + 1 == times.size(), "a joint path with ", times.size(),
               " times needs one piece fewer, not ", controls.size());
  const Eigen::Index rows = controls[0].rows();
  const Eigen::Index columns = controls[0].cols();
  DYOP_REQUIRE(rows >= 1 && columns >= 2 && columns <= Eigen::Index(kMaxDegree) + 1,
               "a piece of a joint path needs a coordinate and 2 to ", kMaxDegree + 1,
               " control points, not ", rows, " and ", columns);
  for (std::size_t i = 0; i < controls.size(); ++i) {
    DYOP_REQUIRE(controls[i].rows() == rows && controls[i].cols() == columns, "piece ", i,
                 " of a joint path has ", controls[i].rows(), " coordinates and ",
                 controls[i].cols(), " control points, the first one has ", rows, " and ", columns);
    DYOP_REQUIRE(controls[i].allFinite(), "control points of piece ", i,
                 " of a joint path must be finite");
    DYOP_REQUIRE(i == 0 || controls[i].col(0) == controls[i - 1].col(columns - 1), "piece ", i,
                 " of a joint path must start where the previous one ends, at (",
                 controls[i - 1].col(columns - 1).transpose(), "), not at (",
                 controls[i].col(0).transpose(), ")");
  }
  return JointPath({times.begin(), times.end()}, controls);
}

JointPath JointPath::linear(std::span<const Scalar> times, std::span<const JointVector> waypoints) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  Controls controls;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    controls.emplace_back(waypoints[i].size(), 2);
    controls.back() << waypoints[i], waypoints[i + 1];
  }
  return bezier(times, controls);
}

JointPath JointPath::cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints,
                           std::span<const JointVector> velocities) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  require_vectors(velocities, times.size(), "velocities");
  DYOP_REQUIRE(velocities[0].size() == waypoints[0].size(), "velocities of a joint path have ",
               velocities[0].size(), " coordinates, waypoints have ", waypoints[0].size());
  Controls controls;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const Scalar third = (times[i + 1] - times[i]) / 3;
    controls.emplace_back(waypoints[i].size(), 4);
    controls.back() << waypoints[i], waypoints[i] + third * velocities[i],
        waypoints[i + 1] - third * velocities[i + 1], waypoints[i + 1];
  }
  return bezier(times, controls);
}

JointPath JointPath::cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  return cubic(times, waypoints, spline_velocities(times, waypoints));
}

JointPath JointPath::quintic(std::span<const Scalar> times, std::span<const JointVector> waypoints,
                             std::span<const JointVector> velocities,
                             std::span<const JointVector> accelerations) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  require_vectors(velocities, times.size(), "velocities");
  require_vectors(accelerations, times.size(), "accelerations");
  DYOP_REQUIRE(
      velocities[0].size() == waypoints[0].size() && accelerations[0].size() == waypoints[0].size(),
      "velocities and accelerations of a joint path have ", velocities[0].size(), " and ",
      accelerations[0].size(), " coordinates, waypoints have ", waypoints[0].size());
  Controls controls;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const Scalar fifth = (times[i + 1] - times[i]) / 5;
    // Second differences of control points, of which there are 5 x 4 in an acceleration.
    const Scalar bend = (times[i + 1] - times[i]) * fifth / 4;
    controls.emplace_back(waypoints[i].size(), 6);
    controls.back() << waypoints[i], waypoints[i] + fifth * velocities[i],
        waypoints[i] + 2 * fifth * velocities[i] + bend * accelerations[i],
        waypoints[i + 1] - 2 * fifth * velocities[i + 1] + bend * accelerations[i + 1],
        waypoints[i + 1] - fifth * velocities[i + 1], waypoints[i + 1];
  }
  return bezier(times, controls);
}

JointPath JointPath::bspline(std::size_t degree, std::span<const Scalar> knots,
                             std::span<const JointVector> control_points) {
  require_knots(degree, knots, control_points.size());
  require_vectors(control_points, control_points.size(), "control points");
  std::vector<Scalar> times{knots[degree]};
  Controls controls;
  for (std::size_t i = degree; i < control_points.size(); ++i) {
    if (knots[i] == knots[i + 1]) continue;
    times.push_back(knots[i + 1]);
    Eigen::MatrixXd control(control_points[0].size(), Eigen::Index(degree + 1));
    for (std::size_t k = 0; k <= degree; ++k) {
      control.col(Eigen::Index(k)) = polar_form(degree, knots, control_points, i, k);
    }
    // Equal up to rounding; leaves no gap between the pieces.
    if (!controls.empty()) control.col(0) = controls.back().col(Eigen::Index(degree));
    controls.push_back(std::move(control));
  }
  return bezier(times, controls);
}

}  // namespace dyop
