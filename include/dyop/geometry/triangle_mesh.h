// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/geometry/contact_features.h"
#include "dyop/geometry/mesh_topology.h"
#include "dyop/geometry/shape.h"
#include "dyop/hierarchy/mesh_hierarchy.h"

namespace DYOP_EXPORT dyop {

/// `count` rows of three numbers, each row `stride_bytes` after the one before: describes a
/// caller's vertex or index buffer. The memory is only used during the call.
template <typename Number>
struct StridedRows {
  const Number* data = nullptr;
  std::size_t count = 0;
  std::size_t stride_bytes = 3 * sizeof(Number);
};

/// A set of triangles with a bounding hierarchy, built once. The set may be open, non-manifold,
/// self-touching, and hold duplicate, zero-area, segment and point triangles: every query treats
/// the triangles as a surface with two sides and no inside. Copies share the data. A mesh that was
/// moved from can be assigned and destroyed; everything else throws InvalidArgument.
class TriangleMesh final : public Shape {
 public:
  /// @throws InvalidArgument if there is no triangle, a vertex is not finite or beyond
  ///         kLargestCoordinate, or an index is out of range; the message names the row and value.
  TriangleMesh(std::vector<Vector3> vertices, std::vector<TriangleIndices> triangles);

  /// From a caller's arrays, float or double, 32-bit indices. Rows need no alignment.
  /// @throws InvalidArgument as above, and for null data or a stride shorter than a row.
  static TriangleMesh from_arrays(StridedRows<double> vertices,
                                  StridedRows<std::int32_t> triangles);
  static TriangleMesh from_arrays(StridedRows<float> vertices, StridedRows<std::int32_t> triangles);
  static TriangleMesh from_arrays(StridedRows<double> vertices,
                                  StridedRows<std::uint32_t> triangles);
  static TriangleMesh from_arrays(StridedRows<float> vertices,
                                  StridedRows<std::uint32_t> triangles);

  /// The same triangles with other vertices, as many as before: for a body that deforms. Keeps the
  /// structure of the hierarchy and refits its boxes, at a fraction of the cost of a new mesh; all
  /// answers remain certified. If neighbouring triangles have moved far apart, a new mesh gives
  /// faster queries. This mesh is not changed.
  /// @throws InvalidArgument if the number of vertices differs, a vertex is not finite or beyond
  ///         kLargestCoordinate; from arrays, also for null data or a stride shorter than a row.
  TriangleMesh with_vertices(std::vector<Vector3> vertices) const;
  TriangleMesh with_vertices(StridedRows<double> vertices) const;
  TriangleMesh with_vertices(StridedRows<float> vertices) const;

  std::span<const Vector3> vertices() const;
  std::span<const TriangleIndices> triangles() const;
  Triangle triangle(std::int32_t index) const;
  const MeshHierarchy& hierarchy() const;

  /// How triangles are connected. Computed on first use, by one thread while others wait; shared
  /// with copies and with_vertices().
  const MeshTopology& topology() const;
  /// Where other bodies can touch the mesh. Computed on first use, likewise; shared with copies.
  const ContactFeatures& contact_features() const;

  /// Whether every edge is used exactly twice, once in each direction (nothing is merged: vertices
  /// are the same only if their numbers are). Triangles that repeat a vertex number do not count;
  /// false if there are no others. From topology().
  bool is_closed() const;

  /// One vertex number of each connected part, in the order of the triangles; triangles that share
  /// a vertex number are connected. Computed on first use, likewise.
  std::span<const std::int32_t> part_vertices() const;

  ShapeKind kind() const override { return ShapeKind::TriangleMesh; }
  /// Bounds of the vertices that triangles use.
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;

  /// Exact integrals over the enclosed polyhedron ([Eberly2002]).
  /// Computed about the centre of the bounding box, so a mesh far from the origin loses only the
  /// precision that its coordinates have already lost.
  /// @throws InvalidArgument if the mesh is not closed or its signed volume is not positive (beyond
  ///         rounding noise); the message states the volume.
  MassProperties compute_mass_properties(Scalar density) const override;

  /// Mass spread evenly over the surface, for open meshes. Segments and points beside it have no
  /// mass. Where there is no area, it is spread along the segments, and over the points where there
  /// is no length either: a wire, a cloud. What lies on one line turns about it like a rod of a
  /// hundredth of its length in thickness.
  /// @param density Mass per area, or per length, or of each point.
  /// @throws InvalidArgument if it is not positive, or all points are at one place.
  MassProperties compute_shell_mass_properties(Scalar density) const;

 private:
  struct Data;
  explicit TriangleMesh(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

  const Data& data() const;

  std::shared_ptr<const Data> data_;  // null if moved from
};

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
