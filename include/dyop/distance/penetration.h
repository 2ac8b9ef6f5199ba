// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

/// Returns depth and direction of two overlapping convex shapes, or nothing if no overlap is found.
/// Moving B by the depth along the direction separates the shapes, rounding included, so the depth
/// is never below the least. For two boxes, rounded or not, it is the least up to rounding: the
/// normals of all faces of their difference are tried. For others it is the best of the normals of
/// their faces, if they have few, and of libccd's expanding polytope algorithm.
std::optional<Penetration> find_penetration(const ConvexShape& a, const RigidPose& X_WA,
                                            const ConvexShape& b, const RigidPose& X_WB);

}  // namespace dyop
