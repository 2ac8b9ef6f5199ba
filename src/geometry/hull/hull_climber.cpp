// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
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

}  // namespace dyop::geometry_internal
