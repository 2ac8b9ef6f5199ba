// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

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

/// Returns depth and direction of two overlapping convex shapes, or nothing if no overlap is found.
/// Moving B by the depth along the direction separates the shapes, rounding included, so the depth
/// is never below the least. For two boxes, rounded or not, it is the least up to rounding: the
/// normals of all faces of their difference are tried. For others it is the best of the normals of
/// their faces, if they have few, and of libccd's expanding polytope algorithm.
std::optional<Penetration> find_penetration(const ConvexShape& a, const RigidPose& X_WA,
                                            const ConvexShape& b, const RigidPose& X_WB);

}  // namespace dyop
