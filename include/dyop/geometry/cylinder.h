// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
