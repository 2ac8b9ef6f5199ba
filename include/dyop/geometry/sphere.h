// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

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

}  // namespace dyop
