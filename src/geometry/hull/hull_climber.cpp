// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/tolerance.h"
#include "geometry/hull/quickhull.h"

namespace dyop::geometry_internal {
namespace {

constexpr int kStartCount = 64;

std::int32_t farthest(std::span<const Vector3> points, const Vector3& direction) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (direction.dot(points[k]) > direction.dot(points[best])) best = k;
  }
  return std::int32_t(best);
}

// Directions spread evenly along a spiral on the unit sphere.
Vector3 spiral_direction(int k) {
  const Scalar z = 1 - (2 * Scalar(k) + 1) / kStartCount;
  const Scalar angle = 2 * std::numbers::pi * k / std::numbers::phi;
  const Scalar r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// What is known about direction . (p - q) despite rounding.
struct Gain {
  Scalar value;
  Scalar noise;
  bool is_positive;      // for certain
  bool is_not_positive;  // for certain; neither holds for NaN

  Gain(const Vector3& direction, const Vector3& p, const Vector3& q) {
    const Vector3 difference = p - q;
    const Vector3 terms = direction.cwiseProduct(difference);
    value = terms.sum();
    // One difference, one product and two sums err by 4u; products may underflow.
    noise = 8 * kUnitRoundoff * terms.lpNorm<1>() + 4 * std::numeric_limits<Scalar>::min();
    is_positive = value > noise;
    is_not_positive = value < -noise || (direction.array() == 0 || difference.array() == 0).all();
  }
};

}  // namespace

HullClimber::HullClimber(const TriangleMesh& surface) : surface_(surface) {
  const std::size_t count = surface.vertices().size();
  first_.assign(count + 1, 0);
  // Every edge of a closed surface starts once at each of its ends.
  for (const TriangleIndices& t : surface.triangles()) {
    for (const std::int32_t v : t) ++first_[std::size_t(v) + 1];
  }
  for (std::size_t v = 0; v < count; ++v) first_[v + 1] += first_[v];
  neighbors_.resize(std::size_t(first_.back()));
  std::vector<std::int32_t> next = first_;
  for (const TriangleIndices& t : surface.triangles()) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbors_[std::size_t(next[std::size_t(t[k])]++)] = t[(k + 1) % 3];
    }
  }
  for (int k = 0; k < kStartCount; ++k) {
    starts_.push_back(farthest(surface.vertices(), spiral_direction(k)));
  }
}

std::int32_t HullClimber::best_start(const Vector3& direction) const {
  const std::span<const Vector3> points = surface_.vertices();
  std::int32_t best = starts_.front();
  Scalar best_value = -kInfinity;
  for (const std::int32_t v : starts_) {
    const Scalar value = direction.dot(points[std::size_t(v)]);
    if (value > best_value) {
      best_value = value;
      best = v;
    }
  }
  return best;
}

std::optional<std::int32_t> HullClimber::find(const Vector3& direction) const {
  const std::span<const Vector3> points = surface_.vertices();
  std::int32_t current = best_start(direction);
  // The value certainly rises with every step, so no vertex is visited twice.
  std::size_t work = 0;
  while (work <= points.size()) {
    const auto begin = std::size_t(first_[std::size_t(current)]);
    const auto end = std::size_t(first_[std::size_t(current) + 1]);
    work += end - begin;
    std::int32_t best = -1;
    Scalar best_value = 0;
    bool is_in_doubt = false;
    for (std::size_t k = begin; k < end; ++k) {
      const Gain gain(direction, points[std::size_t(neighbors_[k])], points[std::size_t(current)]);
      is_in_doubt = is_in_doubt || !gain.is_not_positive;
      if (gain.is_positive && gain.value > best_value) {
        best_value = gain.value;
        best = neighbors_[k];
      }
    }
    if (best < 0) return is_in_doubt ? std::nullopt : std::optional(current);
    current = best;
  }
  return std::nullopt;
}

PointScan::PointScan(std::span<const Vector3> points) : blocks_((points.size() + 3) / kLanes) {
  for (std::size_t k = 0; k < blocks_.size() * kLanes; ++k) {
    const Vector3& p = points[std::min(k, points.size() - 1)];
    Block& block = blocks_[k / kLanes];
    const auto lane = static_cast<Eigen::Index>(k % kLanes);
    block.x[lane] = p.x();
    block.y[lane] = p.y();
    block.z[lane] = p.z();
  }
}

Scalar PointScan::largest(const Vector3& direction) const {
  Lanes best = blocks_.front().along(direction);
  for (std::size_t k = 1; k < blocks_.size(); ++k) best = best.max(blocks_[k].along(direction));
  return best.maxCoeff();
}

std::int32_t PointScan::farthest(const Vector3& direction) const {
  if (blocks_.size() > kKeptBlocks) return farthest_of_many(direction);
  // The values are kept: looking for the largest among them is cheaper than keeping track of
  // numbers.
  std::array<Lanes, kKeptBlocks> values;
  Lanes best = values[0] = blocks_.front().along(direction);
  for (std::size_t k = 1; k < blocks_.size(); ++k) {
    values[k] = blocks_[k].along(direction);
    best = best.max(values[k]);
  }
  const Scalar most = best.maxCoeff();
  const Scalar* value = values[0].data();
  for (std::size_t k = 0; k < blocks_.size() * kLanes; ++k) {
    if (value[k] == most) return static_cast<std::int32_t>(k);
  }
  return 0;
}

std::int32_t PointScan::farthest_of_many(const Vector3& direction) const {
  // Computed twice, with the same bits.
  const Scalar most = largest(direction);
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const Lanes value = blocks_[k].along(direction);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (value[static_cast<Eigen::Index>(lane)] == most) {
        return static_cast<std::int32_t>(k * kLanes + lane);
      }
    }
  }
  return 0;
}

Scalar PointScan::reach(const Vector3& direction) const {
  // A maximum may drop NaN; zero times the direction restores it.
  return largest(direction) + 0 * direction.sum();
}

}  // namespace dyop::geometry_internal
