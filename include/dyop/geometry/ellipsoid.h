// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
