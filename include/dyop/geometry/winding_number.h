// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// How many times the closed mesh winds around the point: 0 outside; 1 inside a mesh whose
/// triangles are counterclockwise seen from outside, -1 if it is inside out; other numbers where it
/// overlaps itself. An integer found by exact predicates, not by tolerances: the signed crossings
/// of the ray from the point along +z. For a point on the surface, the number of one of the
/// adjacent sides. Coordinates below 1e-60 of the mesh's size count as zero.
///
/// Cost: a walk down the hierarchy along the ray, microseconds for 1e5 triangles.
/// @param p_B Point in the mesh's frame, finite.
/// @throws InvalidArgument if the mesh is not closed (TriangleMesh::is_closed()) or p_B not finite.
int winding_number(const TriangleMesh& mesh, const Vector3& p_B);

/// Whether the closed mesh winds around the point at all. Everything else in dyop treats meshes as
/// surfaces without an inside.
/// @throws InvalidArgument as winding_number().
bool contains(const TriangleMesh& mesh, const Vector3& p_B);

}  // namespace dyop
