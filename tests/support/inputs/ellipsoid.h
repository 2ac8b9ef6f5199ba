// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace dyop::testing {

/// A shape that is not the library's: a smooth core without vertices or a surface of triangles.
class UserEllipsoid final : public ConvexShape {
 public:
  explicit UserEllipsoid(const Vector3& radii) : radii_(radii) {}
  SupportPoint core_support(const Vector3& d) const override {
    const Vector3 scaled = radii_.cwiseProduct(d);
    const Scalar norm = scaled.norm();
    return {norm > 0 ? Vector3(radii_.cwiseProduct(scaled) / norm) : Vector3::Zero(), {}};
  }
  Vector3 core_center() const override { return Vector3::Zero(); }
  AlignedBox bounding_box() const override { return {-radii_, radii_}; }
  Scalar bounding_radius() const override { return radii_.maxCoeff(); }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }

 private:
  Vector3 radii_;
};

}  // namespace dyop::testing
