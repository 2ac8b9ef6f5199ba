// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "check/vec.h"

/// The search for directions. UNTRUSTED: whatever it returns, a proof is evaluated by prover.cpp.
namespace dyop_check {

struct Nearest {
  Vec direction;        ///< from A to B
  double distance = 0;  ///< of a point of A and one of B, so at least the distance; 0: they meet
};

/// Up to four points of the set of differences of two convex sets.
struct Simplex {
  std::array<Vec, 4> points;
  std::size_t count = 0;

  /// The point of the hull that is nearest to the origin; keeps the points that span it. False if
  /// none was found, or the origin may be inside.
  bool reduce(Vec& nearest);
  /// Whether four points hold the origin: then the sets have a point in common.
  bool holds_origin() const;
};

/// The distance of two convex sets, by GJK [GilbertJohnsonKeerthi1988].
/// @param difference Gives the point b - a of the set of differences that is farthest along a
///                   direction.
template <typename Difference>
Nearest nearest_direction(const Difference& difference, const Vec& guess) {
  constexpr int kMostIterations = 60;
  constexpr double kClose = 1e-13;  // literal: relative, of the squared distance
  Vec v = difference(-1.0 * guess);
  Simplex simplex;
  simplex.points[simplex.count++] = v;
  for (int k = 0; k < kMostIterations; ++k) {
    const double squared = dot(v, v);
    if (!(squared > 0)) break;
    const Vec w = difference(-1.0 * v);
    if (squared - dot(v, w) <= kClose * squared) break;
    simplex.points[simplex.count++] = w;
    if (simplex.holds_origin()) return {v, 0};
    Vec next;
    if (!simplex.reduce(next) || !(dot(next, next) < squared)) break;
    v = next;
  }
  return {v, norm(v)};
}

}  // namespace dyop_check
