// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/compound_tree.h"

namespace dyop::distance_internal {

/// The point of a triangle nearest to another point, with proven bounds on their distance.
struct PointTriangleDistance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Vector3 p_C = Vector3::Zero();      ///< on the triangle, within rounding
  Vector3 nhat_C = Vector3::UnitX();  ///< unit, from the triangle to the point; proves `lower`
  Feature feature;                    ///< local vertex numbers 0, 1, 2
};

/// Certified as triangle_distance() with the point as a degenerate triangle, at a third of its
/// cost: the direction of [Ericson2005] 5.1.5 is tried first.
PointTriangleDistance point_triangle_distance(const Vector3& p, const Triangle& triangle);

/// The triangle of a mesh nearest to a point, all in the mesh's frame.
struct NearestToPoint {
  PointTriangleDistance nearest;  ///< `lower` is for the whole mesh
  std::int32_t triangle = -1;     ///< -1: the mesh is farther than the limit, `lower` above it
};

/// Depth-first branch and bound, nearest box first. No allocation.
/// @param limit Triangles proven farther away are not sought.
NearestToPoint find_nearest_to_point(const TriangleMesh& mesh, const Vector3& p, Scalar limit);

/// Visits the children of a compound that may be the nearest to a point, both in its frame, nearest
/// box first. visit(child) returns how far others may be to count.
/// @return Lower bound on the distance of those that it left out.
Scalar visit_parts_near_point(const geometry_internal::CompoundTree& tree, const Vector3& p,
                              Scalar limit, const std::function<Scalar(std::int32_t)>& visit);

/// Which of two shapes the caller declares to be solids.
struct Solids {
  bool a = false;
  bool b = false;
};

/// Throws InvalidArgument, prefixed with the name of the query, if a solid is a mesh that is not
/// closed.
void require_closed(const char* query, const Shape& a, const Shape& b, const Solids& solids);

/// For shapes whose surfaces do not meet: a point, in world, of a part of one that lies inside the
/// other, which must be a closed mesh declared solid; nothing if there is none.
std::optional<Vector3> find_enclosed_point(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const Solids& solids);

}  // namespace dyop::distance_internal
