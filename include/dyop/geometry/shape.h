// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string_view>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Mass, centre of mass and inertia of a body, in the frame B of its shape.
struct MassProperties {
  Scalar mass = 0;                    ///< > 0
  Vector3 p_BoBcm = Vector3::Zero();  ///< centre of mass
  Matrix3 I_BBcm = Matrix3::Zero();   ///< rotational inertia about the centre of mass, axes of B
};

/// The same mass distribution scaled to a given total mass.
/// @throws InvalidArgument unless mass is finite and positive.
MassProperties with_mass(const MassProperties& properties, Scalar mass);

enum class ShapeKind { TriangleMesh, Convex, Compound };

/// The kind of feature a witness point lies on. Smooth: a curved surface.
enum class FeatureKind { Vertex, Edge, Face, Smooth };

/// The enumerator's name.
std::string_view name_of(FeatureKind kind);
std::ostream& operator<<(std::ostream& out, FeatureKind kind);

/// A feature, given by the shape's own vertex numbers (for a curved shape: those of its core).
struct Feature {
  FeatureKind kind = FeatureKind::Smooth;
  std::array<std::int32_t, 3> vertices{};  ///< the first vertex_count() are set, the others are 0

  /// Vertex: 1, Edge: 2, Face: 3, Smooth: 0.
  constexpr std::size_t vertex_count() const {
    return kind == FeatureKind::Smooth ? 0 : static_cast<std::size_t>(kind) + 1;
  }

  friend bool operator==(const Feature&, const Feature&) = default;
};

/// A rigid shape at rest in its own frame. Immutable once built, so that bodies and threads can
/// share it.
///
/// Three kinds exist: TriangleMesh, everything that derives from ConvexShape, and CompoundShape,
/// which holds several of both.
///
/// To add a shape:
///   1. a class that derives from ConvexShape, in `include/dyop/geometry/primitives.h` and `.cpp`;
///      a large one gets files of its own, listed in `src/geometry/CMakeLists.txt`;
///   2. one word in `tests/geometry/all_shapes.h`: the contract tests check support function,
///      bounds and mass properties, and every query with every other shape;
///   3. one entry in `src/geometry/shape_forms.cpp`, if a few numbers define it: scenes, query
///      records, recordings, the player and the command line know it by that.
class Shape {
 public:
  virtual ~Shape() = default;

  virtual ShapeKind kind() const = 0;

  /// Axis-aligned bounds in the shape's frame; contains every point of the shape.
  virtual AlignedBox bounding_box() const = 0;

  /// Largest distance of any point of the shape from the frame's origin, rounded up.
  virtual Scalar bounding_radius() const = 0;

  /// The length that defaults of World go by: bounding_radius(), but at most half the diagonal of
  /// bounding_box(), so that a shape far from its frame's origin is no larger for it.
  Scalar size() const;

  /// Mass properties of the solid body of this density (mass per volume).
  /// @throws InvalidArgument if density is not finite and positive, or the shape encloses no
  /// volume.
  virtual MassProperties compute_mass_properties(Scalar density) const = 0;
};

/// The shape stretched along the axes of its frame; negative factors mirror it. Exact but for the
/// rounding of its numbers: a sphere becomes an ellipsoid where factors differ, a half-space a
/// half-space. Boxes, ellipsoids, hulls and meshes, whose triangles go on facing outward, take any
/// factors; what is round about z, those of one size along x and y; what is rounded, those of one
/// size.
/// Children of a compound are scaled about its origin: meshes, hulls, boxes and spheres by any
/// factors, however they are turned. What cannot stay in its own frame, such as a cone upside down,
/// becomes a compound. Meshes and hulls are copied.
/// @throws InvalidArgument if a factor is zero or not finite, the result is out of range, or the
///         shape does not take these factors; the message says which, and names the child.
std::shared_ptr<const Shape> scaled(const Shape& shape, const Vector3& factors);

}  // namespace dyop
