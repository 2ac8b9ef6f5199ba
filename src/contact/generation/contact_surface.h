// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/generation/feature_witness.h"
#include "dyop/contact/contact_point.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::contact_internal {

/// The surface of a shape's core, and whether a direction lies in its normal cone. All points and
/// directions are in the shape's frame. Does not own the shape.
class ContactSurface {
 public:
  explicit ContactSurface(const Shape& shape);

  /// Null for a smooth core.
  const TriangleMesh* mesh = nullptr;
  const ContactFeatures* features = nullptr;
  const MeshTopology* topology = nullptr;
  Scalar radius = 0;
  bool is_mesh = false;    ///< the shape itself is a mesh: its triangles are numbered
  bool has_parts = false;  ///< not connected: its parts may touch each other
  bool is_solid = false;   ///< convex with a volume: only the outer sides of faces count

  /// Whether n . t <= sine for all unit directions t in which the surface leaves a vertex, or a
  /// point within an edge. Doubtful cases test all triangles at that point, see touches_clear().
  bool admits_at_vertex(std::int32_t vertex, const Vector3& n, Scalar sine, Scalar noise) const;
  bool admits_at_edge(std::int32_t edge, const Vector3& p, const Vector3& n, Scalar sine,
                      Scalar noise) const;

  /// Whether the surface admits n at a foot on one of its triangles, and the key of that foot.
  bool admits_at_foot(std::int32_t triangle, const TriangleFoot& foot, const Vector3& p,
                      const Vector3& n, Scalar sine, Scalar noise) const;
  FeatureKey foot_key(std::int32_t triangle, const TriangleFoot& foot) const;

  const TriangleIndices& indices(std::int32_t triangle) const {
    return triangles_[std::size_t(triangle)];
  }

 private:
  /// Whether no triangle within rounding of p rises along n more steeply than `sine`. Finds what
  /// vertex numbers do not show, such as triangles that touch without a common vertex.
  bool touches_clear(const Vector3& p, const Vector3& n, Scalar sine, Scalar noise) const;
  bool triangle_is_clear(std::int32_t triangle, const Vector3& p, const Vector3& n, Scalar sine,
                         Scalar noise) const;

  std::span<const Vector3> vertices_;
  std::span<const TriangleIndices> triangles_;
};

}  // namespace dyop::contact_internal
