// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// Ball about the origin of its frame.
class Sphere final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless 0 < radius <= kLargestCoordinate.
  explicit Sphere(Scalar radius);

  Scalar radius() const { return radius_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override { return Vector3::Zero(); }
  const TriangleMesh* core_surface() const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override { return radius_; }
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Scalar radius_;
};

/// Solid ellipsoid about the origin, its axes along those of its frame. Its surface is smooth:
/// features are FeatureKind::Smooth.
class Ellipsoid final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless all semi-axes are > 0 and at most kLargestCoordinate.
  explicit Ellipsoid(const Vector3& semi_axes);

  const Vector3& semi_axes() const { return semi_axes_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Vector3 core_center() const override { return Vector3::Zero(); }
  AlignedBox bounding_box() const override { return {-semi_axes_, semi_axes_}; }
  Scalar bounding_radius() const override { return semi_axes_.maxCoeff(); }
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Vector3 semi_axes_;
};

namespace geometry_internal {
class SurfaceOnDemand;
}

/// Axis-aligned box about the origin of its frame. Bit k of a vertex number (0 to 7) is set where
/// coordinate k is positive.
class Box final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless all half extents are > 0 and at most kLargestCoordinate.
  explicit Box(const Vector3& half_extents);
  Box(const Box&) = default;  // no move: a box always has a surface
  Box& operator=(const Box&) = default;
  ~Box() override = default;

  const Vector3& half_extents() const { return half_extents_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Scalar core_reach(const Vector3& direction) const override {
    return direction.cwiseAbs().dot(half_extents_);
  }
  Vector3 core_center() const override { return Vector3::Zero(); }
  const TriangleMesh* core_surface() const override;
  AlignedBox bounding_box() const override { return {-half_extents_, half_extents_}; }
  Scalar bounding_radius() const override { return simple_core().bounding_radius; }
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Vector3 half_extents_;
  std::shared_ptr<const geometry_internal::SurfaceOnDemand> surface_;  // shared with copies
};

/// All points within a radius of an axis-aligned box about the origin. Vertices of the core are
/// numbered as those of Box.
class RoundedBox final : public ConvexShape {
 public:
  /// @param half_extents Of the core: the shape reaches a radius beyond.
  /// @throws InvalidArgument unless the radius and all half extents are > 0 and at most
  ///         kLargestCoordinate.
  RoundedBox(const Vector3& half_extents, Scalar radius);

  const Vector3& half_extents() const { return core_.half_extents(); }
  Scalar radius() const { return radius_; }

  SupportPoint core_support(const Vector3& direction) const override {
    return core_.core_support(direction);
  }
  Scalar core_reach(const Vector3& direction) const override { return core_.core_reach(direction); }
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override { return Vector3::Zero(); }
  const TriangleMesh* core_surface() const override { return core_.core_surface(); }
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override { return simple_core().bounding_radius; }
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  RoundedBox(Box&& core, Scalar radius);

  Box core_;
  Scalar radius_;
};

namespace geometry_internal {
class SurfaceOnDemand;
}

/// All points within a radius of a segment on the z axis, centred at the origin. Vertex 0 of the
/// core is its lower end, vertex 1 its upper end.
class Capsule final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless 0 < radius and 0 <= half_length, both at most
  ///         kLargestCoordinate.
  Capsule(Scalar radius, Scalar half_length);
  Capsule(const Capsule&) = default;  // no move: a capsule always has a surface
  Capsule& operator=(const Capsule&) = default;
  ~Capsule() override = default;

  Scalar radius() const { return radius_; }
  Scalar half_length() const { return half_length_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Scalar rounding_radius() const override { return radius_; }
  Vector3 core_center() const override { return Vector3::Zero(); }
  const TriangleMesh* core_surface() const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Scalar radius_;
  Scalar half_length_;
  std::shared_ptr<const geometry_internal::SurfaceOnDemand> segment_;  // shared with copies
};

/// Convex hull of two balls on the z axis, one about z = -half_length, the other about
/// z = half_length. Its surface is smooth: features are FeatureKind::Smooth.
class TaperedCapsule final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless all lengths are > 0 and at most kLargestCoordinate, and neither
  ///         ball holds the other: |bottom_radius - top_radius| < 2 half_length.
  TaperedCapsule(Scalar bottom_radius, Scalar top_radius, Scalar half_length);

  Scalar bottom_radius() const { return bottom_radius_; }
  Scalar top_radius() const { return top_radius_; }
  Scalar half_length() const { return half_length_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Vector3 core_center() const override;
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Scalar bottom_radius_;
  Scalar top_radius_;
  Scalar half_length_;
};

/// Solid cylinder about the z axis, centred at the origin, with flat ends. Its surface is smooth:
/// features are FeatureKind::Smooth.
class Cylinder final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless 0 < radius and 0 < half_length, both at most
  ///         kLargestCoordinate.
  Cylinder(Scalar radius, Scalar half_length);

  Scalar radius() const { return radius_; }
  Scalar half_length() const { return half_length_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Vector3 core_center() const override { return Vector3::Zero(); }
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Scalar radius_;
  Scalar half_length_;
};

/// All points within an edge radius of a cylinder about the z axis, centred at the origin.
class RoundedCylinder final : public ConvexShape {
 public:
  /// @param radius, half_length Of the core: the shape reaches an edge radius beyond.
  /// @throws InvalidArgument unless all lengths are > 0 and at most kLargestCoordinate.
  RoundedCylinder(Scalar radius, Scalar half_length, Scalar edge_radius);

  Scalar radius() const { return core_.radius(); }
  Scalar half_length() const { return core_.half_length(); }
  Scalar edge_radius() const { return edge_radius_; }

  SupportPoint core_support(const Vector3& direction) const override {
    return core_.core_support(direction);
  }
  Scalar rounding_radius() const override { return edge_radius_; }
  Vector3 core_center() const override { return Vector3::Zero(); }
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override {
    return core_.flat_part(unit_direction, sine);
  }
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Cylinder core_;
  Scalar edge_radius_;
};

/// Solid cone about the z axis: the tip at z = half_length, the base a disc at z = -half_length.
/// Its surface is smooth: features are FeatureKind::Smooth.
class Cone final : public ConvexShape {
 public:
  /// @throws InvalidArgument unless 0 < radius and 0 < half_length, both at most
  ///         kLargestCoordinate.
  Cone(Scalar radius, Scalar half_length);

  Scalar radius() const { return radius_; }
  Scalar half_length() const { return half_length_; }

  SupportPoint core_support(const Vector3& direction) const override;
  Vector3 core_center() const override { return Vector3::Zero(); }
  FlatPart flat_part(const Vector3& unit_direction, Scalar sine) const override;
  AlignedBox bounding_box() const override;
  Scalar bounding_radius() const override;
  MassProperties compute_mass_properties(Scalar density) const override;

 private:
  Scalar radius_;
  Scalar half_length_;
};

}  // namespace dyop
