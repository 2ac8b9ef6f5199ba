// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

class TriangleMesh;

/// A farthest point along a direction, and its vertex number (none for a smooth core).
struct SupportPoint {
  Vector3 point = Vector3::Zero();
  std::optional<std::int32_t> vertex;
};

/// A convex set given by a support function: a convex *core*, inflated by a ball of radius
/// rounding_radius(). A sphere is a point and a radius, a capsule a segment and a radius, a box or
/// hull a polytope and no radius. Algorithms work on the core and add the radius exactly at the
/// end.
class ConvexShape : public Shape {
 public:
  ShapeKind kind() const final { return ShapeKind::Convex; }

  /// A point of the core that maximises direction . p; any point of the core for a zero direction.
  /// The maximum must be exact up to rounding: |direction| * bounding_radius() * 8u.
  virtual SupportPoint core_support(const Vector3& direction) const = 0;

  /// The largest direction . p over the core, to the same accuracy; NaN for a direction that is
  /// not finite. Override it where the point itself costs more.
  virtual Scalar core_reach(const Vector3& direction) const {
    return direction.dot(core_support(direction).point);
  }

  /// Radius of the ball that inflates the core, >= 0.
  virtual Scalar rounding_radius() const { return 0; }

  /// A point of the core, as central as can be found cheaply.
  virtual Vector3 core_center() const = 0;

  /// The core's surface as triangles with the same vertex numbers as core_support() (a point or a
  /// segment is a degenerate triangle), or null for a smooth core. Used to gather contact patches
  /// and to take longer steps towards an impact.
  virtual const TriangleMesh* core_surface() const { return nullptr; }

  /// A farthest point of the whole shape along a unit direction.
  Vector3 support(const Vector3& unit_direction) const {
    return core_support(unit_direction).point + rounding_radius() * unit_direction;
  }
};

}  // namespace dyop
