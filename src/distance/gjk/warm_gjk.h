// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/distance/gjk.h"

namespace dyop::distance_internal {

/// What a query of two convex shapes passes to the next one of the same two at slightly different
/// poses: the support points that spanned the nearest point, each in the frame of its shape.
struct GjkSeed {
  std::array<SupportPoint, 3> a;
  std::array<SupportPoint, 3> b;
  std::size_t count = 0;  ///< 0: none
};

/// When less than the exact distance is enough; the bounds hold regardless.
struct GjkGoal {
  /// Stop once lower > apart with upper - lower <= share * (lower - apart).
  Scalar apart = kInfinity;
  Scalar share = 0;
  /// Stop once upper - lower <= slack.
  Scalar slack = 0;
  /// Stop once upper < hit.
  Scalar hit = -kInfinity;
};

/// gjk_distance() starting with the points of `seed`, if there are any, and storing its own there.
/// A query that ends by its goal names no features.
GjkResult gjk_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                       const GjkGoal& goal, GjkSeed& seed);

}  // namespace dyop::distance_internal
