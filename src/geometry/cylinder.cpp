// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/cylinder.h"

#include <cmath>
#include <numbers>

#include "geometry/rim.h"
#include "geometry/solid.h"

namespace dyop {

Cylinder::Cylinder(Scalar radius, Scalar half_length) : radius_(radius), half_length_(half_length) {
  geometry_internal::require_length("radius", radius);
  geometry_internal::require_length("half length of a cylinder", half_length);
}

SupportPoint Cylinder::core_support(const Vector3& direction) const {
  const Scalar height = direction.z() >= 0 ? half_length_ : -half_length_;
  return {geometry_internal::rim_towards(direction, radius_, height), std::nullopt};
}

FlatPart Cylinder::flat_part(const Vector3& unit_direction, Scalar sine) const {
  const Scalar side = unit_direction.z() >= 0 ? 1 : -1;
  if (unit_direction.head<2>().norm() <= sine) {
    const Vector3 up(0, 0, side);
    return {FlatPart::Kind::Disc, half_length_ * up, up, radius_};
  }
  if (!(std::abs(unit_direction.z()) <= sine)) return {};
  const Vector3 center = geometry_internal::rim_towards(unit_direction, radius_, 0);
  return {FlatPart::Kind::Segment, center, Vector3(0, 0, half_length_), 0};
}

AlignedBox Cylinder::bounding_box() const {
  const Vector3 half(radius_, radius_, half_length_);
  return {-half, half};
}

Scalar Cylinder::bounding_radius() const {
  return geometry_internal::length_up(radius_, half_length_);
}

MassProperties Cylinder::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  const Scalar r_sq = radius_ * radius_;
  const Scalar h = half_length_;
  MassProperties properties;
  properties.mass = density * (2 * std::numbers::pi) * r_sq * h;
  const Scalar transverse = properties.mass * (r_sq / 4 + h * h / 3);
  properties.I_BBcm = Vector3(transverse, transverse, properties.mass * r_sq / 2).asDiagonal();
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
