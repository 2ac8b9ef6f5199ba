// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
