// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/types.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::contact_internal {

/// Where the point of a triangle nearest to another point lies.
struct TriangleFoot {
  FeatureKind kind = FeatureKind::Face;
  /// What the point lies on; with kind Face, a corner or side if the foot is slightly off the
  /// triangle.
  FeatureKind place = FeatureKind::Face;
  int index = 0;  ///< of the corner, or of the side that starts at it
  Vector3 point = Vector3::Zero();
  /// With kind Face: unit normal of the triangle, on the side of the other point.
  Vector3 normal = Vector3::UnitX();
  /// With kind Face: the other point is on the outer side, by the triangle's winding.
  bool is_outer = true;
};

/// The point of `t` nearest to `p`, or nothing if it is certainly farther than `reach`. A foot that
/// is off the triangle by no more than `border_sine` times the height, or by `noise`, counts as on
/// the face.
std::optional<TriangleFoot> find_foot(const Triangle& t, const Vector3& p, Scalar reach,
                                      Scalar border_sine, Scalar noise);

/// The common perpendicular of two segments.
struct EdgeCrossing {
  Vector3 p_a = Vector3::Zero();
  Vector3 p_b = Vector3::Zero();
  Vector3 normal = Vector3::UnitX();  ///< unit, perpendicular to both, either sign
  Scalar sine = 0;                    ///< of the angle between the segments
};

/// Nothing if a foot is off its segment by more than `noise`, if the lines are farther apart than
/// `reach`, or if they are parallel to within kContactNoCrossingSine.
std::optional<EdgeCrossing> find_crossing(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                                          const Vector3& b1, Scalar reach, Scalar noise);

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
