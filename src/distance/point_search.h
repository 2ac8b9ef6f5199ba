// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "distance/point_triangle.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::distance_internal {

/// The triangle of a mesh nearest to a point, all in the mesh's frame.
struct NearestToPoint {
  PointTriangleDistance nearest;  ///< `lower` is for the whole mesh
  std::int32_t triangle = -1;     ///< -1: the mesh is farther than the limit, `lower` above it
};

/// Depth-first branch and bound, nearest box first. No allocation.
/// @param limit Triangles proven farther away are not sought.
NearestToPoint find_nearest_to_point(const TriangleMesh& mesh, const Vector3& p, Scalar limit);

}  // namespace dyop::distance_internal
