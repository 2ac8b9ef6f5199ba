// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
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

/// Cores for which distances have closed forms. General: any other; only its support function is
/// known. HalfSpace: of the class HalfSpace only.
enum class CoreKind : std::uint8_t { General, Point, Segment, Box, HalfSpace };
inline constexpr std::size_t kCoreKinds = 5;

/// The core of a ConvexShape in numbers, in the shape's frame. Vertices are numbered as by
/// ConvexShape::core_support(): a point is vertex 0, a segment goes from vertex 0 to vertex 1, and
/// bit k of a box's vertex number is set where coordinate k is positive.
struct SimpleCore {
  CoreKind kind = CoreKind::General;
  bool is_centred = true;                  ///< center is zero
  Scalar rounding_radius = 0;              ///< of the ball that inflates the core
  Scalar bounding_radius = 0;              ///< of the whole shape, as Shape::bounding_radius()
  Vector3 center = Vector3::Zero();        ///< of a box: must be zero
  Vector3 half_extents = Vector3::Zero();  ///< Segment: from its centre to vertex 1. Box: along
                                           ///< the axes of the frame
};

/// A flat part of a smooth core's surface, in the shape's frame.
struct FlatPart {
  enum class Kind : std::uint8_t { None, Segment, Disc };
  Kind kind = Kind::None;
  Vector3 center = Vector3::Zero();
  Vector3 axis = Vector3::UnitZ();  ///< Disc: unit, outwards. Segment: from the centre to one end
  Scalar radius = 0;                ///< of the disc
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

  /// The flat part of a smooth core's surface that faces a direction: a disc whose normal leans
  /// from it by at most an angle with this sine, or the straight line of a side that is
  /// perpendicular to it up to such an angle. Contacts lie on its border. None for a core with a
  /// core_surface(), and where the surface is curved both ways.
  /// @param sine In [0, 0.5].
  virtual FlatPart flat_part(const Vector3& /*unit_direction*/, Scalar /*sine*/) const {
    return {};
  }

  /// A farthest point of the whole shape along a unit direction.
  Vector3 support(const Vector3& unit_direction) const {
    return core_support(unit_direction).point + rounding_radius() * unit_direction;
  }

  /// The core in numbers, if it is a point, a segment or a box: distances then come from closed
  /// forms. Agrees with the functions above.
  const SimpleCore& simple_core() const { return simple_core_; }

 protected:
  ConvexShape() = default;
  explicit ConvexShape(const SimpleCore& core) : simple_core_(core) {}

 private:
  SimpleCore simple_core_;
};

}  // namespace dyop
