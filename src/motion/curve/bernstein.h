// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "dyop/core/types.h"

// Vector polynomials given by their Bernstein coefficients over s in [0, 1], one more than the
// degree: the polynomial lies in their convex hull, so the largest norm of a coefficient bounds its
// norm.
namespace dyop::motion_internal {

inline constexpr std::size_t kMaxBernsteinCount = 20;
using BernsteinSpan = std::span<const Vector3>;
using BernsteinBuffer = std::array<Vector3, kMaxBernsteinCount>;

// Exactly rounded at the ends.
inline Vector3 mix(const Vector3& x, const Vector3& y, Scalar s) {
  return (1 - s) * x + s * y;
}

// The value at s, by de Casteljau's algorithm.
Vector3 evaluate(BernsteinSpan b, Scalar s);

// The coefficients of the same polynomial over [s0, s1], equally many, into `part`.
void restrict_to(BernsteinSpan b, Scalar s0, Scalar s1, std::span<Vector3> part);

// The coefficients of the derivative with respect to t = h s; one fewer, into `rate`.
void derive(BernsteinSpan b, Scalar h, std::span<Vector3> rate);

// The largest norm of a coefficient, which bounds the norm of the polynomial; 0 if there are none;
// NaN if one is NaN.
Scalar largest_norm(BernsteinSpan b);

// The largest norm of a coefficient of x(s) x y(s).
Scalar largest_cross_product(BernsteinSpan x, BernsteinSpan y);

/// Speed bounds of the pieces of a motion, with the largest over any range of pieces in O(log n).
class SpeedTree {
 public:
  struct Speeds {
    Scalar linear = 0;   ///< length per time
    Scalar angular = 0;  ///< radians per time
  };

  SpeedTree() = default;
  explicit SpeedTree(const std::vector<Speeds>& pieces);

  /// Over the pieces first to last, inclusive; zero if there are none.
  Speeds largest(std::size_t first, std::size_t last) const;

 private:
  std::vector<Speeds> nodes_;  // node i holds the larger of nodes 2i and 2i + 1; the pieces last
};

}  // namespace dyop::motion_internal
