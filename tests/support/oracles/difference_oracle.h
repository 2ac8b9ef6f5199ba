// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {

/// The volume of a closed mesh less a box, by CGAL's Boolean operations in exact arithmetic.
/// @param half_extents Of the box, about the origin of its frame K.
Scalar oracle_volume_less_box(const TriangleMesh& mesh_W, const RigidPose& X_WK,
                              const Vector3& half_extents);

}  // namespace dyop::testing
