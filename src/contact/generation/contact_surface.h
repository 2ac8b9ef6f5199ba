// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/generation/feature_witness.h"
#include "dyop/contact/contact_point.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::internal {

/// The surface of a shape's core, and what decides whether a normal is one of its normal cone. All
/// points and directions in the shape's frame. Does not own the shape.
class ContactSurface {
 public:
  explicit ContactSurface(const Shape& shape);

  /// Null for a smooth core.
  const TriangleMesh* mesh = nullptr;
  const ContactFeatures* features = nullptr;
  const MeshTopology* topology = nullptr;
  Scalar radius = 0;
  bool is_mesh = false;    ///< the shape itself is a mesh: triangles have numbers
  bool has_parts = false;  ///< not connected: parts may touch one another
  bool is_solid = false;   ///< convex with a volume: only outer sides of faces are touched

  /// Whether n . t <= sine for all unit directions t in which the surface leaves a vertex, a point
  /// within an edge. Doubtful ones ask all triangles that touch the point, see touches_clear().
  bool admits_at_vertex(std::int32_t vertex, const Vector3& n, Scalar sine, Scalar noise) const;
  bool admits_at_edge(std::int32_t edge, const Vector3& p, const Vector3& n, Scalar sine,
                      Scalar noise) const;

  /// Whether the surface admits n at a foot on one of its triangles, and the foot's name.
  bool admits_at_foot(std::int32_t triangle, const TriangleFoot& foot, const Vector3& p,
                      const Vector3& n, Scalar sine, Scalar noise) const;
  FeatureKey foot_key(std::int32_t triangle, const TriangleFoot& foot) const;

  const TriangleIndices& indices(std::int32_t triangle) const {
    return triangles_[std::size_t(triangle)];
  }

 private:
  /// No triangle within rounding of p rises along n by more than `sine` of the way: finds what vertex
  /// numbers do not tell, such as triangles that touch without a common vertex.
  bool touches_clear(const Vector3& p, const Vector3& n, Scalar sine, Scalar noise) const;
  bool triangle_is_clear(std::int32_t triangle, const Vector3& p, const Vector3& n, Scalar sine,
                         Scalar noise) const;

  std::span<const Vector3> vertices_;
  std::span<const TriangleIndices> triangles_;
};

}  // namespace dyop::internal
