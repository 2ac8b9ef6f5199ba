// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

/// Returns depth and direction of two overlapping convex shapes by libccd's expanding polytope
/// algorithm, or nothing if libccd finds no overlap or does not converge. An estimate: libccd gives
/// no error bound.
std::optional<Penetration> find_penetration(const ConvexShape& a, const RigidPose& X_WA,
                                            const ConvexShape& b, const RigidPose& X_WB);

}  // namespace dyop
