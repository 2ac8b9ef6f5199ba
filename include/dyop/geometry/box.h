// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
