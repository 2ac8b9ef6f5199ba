// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/box.h"
#include "dyop/geometry/convex_shape.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
