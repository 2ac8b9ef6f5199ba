// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
