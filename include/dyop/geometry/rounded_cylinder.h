// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/cylinder.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
