// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

/// Result of gjk_distance() for the rounded shapes, in frame A of the first shape.
struct GjkResult : NearestPoints {
  int iterations = 0;
};

/// Returns the distance of two convex shapes, with a certificate on both sides.
///
/// The lower bound is the slab gap along the best direction found, evaluated with the support
/// functions and rounded down; the upper bound is the distance between points of the shapes,
/// rounded up. Both hold whatever the iteration does; only their difference depends on convergence.
///
/// @param X_AB Pose of b's frame in a's frame.
/// Bounded number of iterations, no allocation. See [GilbertJohnsonKeerthi1988],
/// [vandenBergen2003], docs/algorithms/gjk.md.
GjkResult gjk_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB);

}  // namespace dyop
