// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/sphere.h"

#include <numbers>

#include "dyop/geometry/triangle_mesh.h"
#include "geometry/solid.h"

namespace dyop {

Sphere::Sphere(Scalar radius)
    : ConvexShape({.kind = CoreKind::Point, .rounding_radius = radius, .bounding_radius = radius}),
      radius_(radius) {
  geometry_internal::require_length("radius", radius);
}

SupportPoint Sphere::core_support(const Vector3&) const {
  return {Vector3::Zero(), 0};
}

const TriangleMesh* Sphere::core_surface() const {
  static const TriangleMesh origin({Vector3::Zero()}, {{0, 0, 0}});
  return &origin;
}

AlignedBox Sphere::bounding_box() const {
  return {Vector3::Constant(-radius_), Vector3::Constant(radius_)};
}

MassProperties Sphere::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  MassProperties properties;
  const Scalar radius_sq = radius_ * radius_;
  properties.mass = density * (4 * std::numbers::pi / 3) * radius_sq * radius_;
  properties.I_BBcm = Matrix3::Identity() * (0.4 * properties.mass * radius_sq);
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
