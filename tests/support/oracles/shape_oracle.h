// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {

/// Distance of two posed shapes by brute force over all pairs of triangles, in quad precision.
///
/// Meshes are surfaces; a convex shape is the solid inside its core's surface, inflated by its
/// rounding radius. A convex shape in another, and any part of a mesh in a convex core, count as
/// overlap; a convex shape in the hollow of a mesh does not. A core thinner than 2^-60 of its size
/// counts as a surface.
///
/// Poses are taken as the exact doubles of their matrices and applied in quad precision. A pair of
/// triangles is skipped only if its boxes prove it farther apart than one already measured.
/// Cost: 2 ns per pair of triangles plus 0.05 ms for each near pair: 5000 x 5000 takes a second.
///
/// @throws InvalidArgument for a convex shape whose core_surface() is null.
OracleDistance oracle_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                               const RigidPose& X_WB);

/// The triangles that represent a shape, and the solid they enclose.
struct OracleSurface {
  const TriangleMesh* triangles;
  Scalar rounding_radius;
  bool is_solid;
};

/// @throws InvalidArgument as above. The mesh belongs to the shape.
OracleSurface oracle_surface(const Shape& shape);

/// Whether one shape lies inside the core of the other, given that their surfaces do not meet: the
/// part of an overlap that no distance of surfaces detects.
bool oracle_contains(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB);

/// All triangles in world, with 113 bits.
std::vector<PointTriangle<Quad>> posed_triangles(const TriangleMesh& mesh, const RigidPose& X_WM);

}  // namespace dyop::testing
