// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::testing {

/// A mesh as plain arrays, so that a test may move or break it before it becomes a TriangleMesh.
struct MeshArrays {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;

  TriangleMesh mesh() const { return TriangleMesh(vertices, triangles); }

  /// Rotated, scaled, then translated.
  MeshArrays moved(const Matrix3& rotation, const Vector3& translation, Scalar scale = 1) const;
};

/// Sphere of 20 * 4^subdivisions triangles with all vertices at `radius`. Closed.
MeshArrays icosphere(int subdivisions, Scalar radius = 1);

/// Torus about the z axis of 2 * major_segments * minor_segments triangles. Closed.
MeshArrays torus(Scalar major_radius, Scalar minor_radius, int major_segments, int minor_segments);

/// Twelve triangles about the origin. Closed.
MeshArrays box_mesh(const Vector3& half_extents);

/// Flat open sheet in the plane z = 0 about the origin, 2 * cells_x * cells_y triangles.
MeshArrays plate_grid(Scalar size_x, Scalar size_y, int cells_x, int cells_y);

/// Chain of segments (triangles that repeat a vertex) on the z axis from 0 to `length`.
MeshArrays needle(Scalar length, int segments);

/// Points (triangles that are one vertex three times) with coordinates in [-1, 1].
MeshArrays point_cloud(int count, std::uint64_t seed);

/// Unconnected triangles of size about `size` with centers in [-1, 1]^3; a third are degenerate:
/// segments, points, slivers and duplicates in turn.
MeshArrays random_soup(int count, Scalar size, std::uint64_t seed);

/// Gear about the z axis with square teeth, thickness along z. Closed, not convex.
MeshArrays gear(int teeth, Scalar root_radius, Scalar tip_radius, Scalar thickness);

}  // namespace dyop::testing
