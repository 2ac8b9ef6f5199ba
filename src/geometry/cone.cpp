// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/cone.h"

#include <cmath>
#include <numbers>

#include "geometry/rim.h"
#include "geometry/solid.h"

namespace dyop {

Cone::Cone(Scalar radius, Scalar half_length) : radius_(radius), half_length_(half_length) {
  geometry_internal::require_length("radius", radius);
  geometry_internal::require_length("half length of a cone", half_length);
}

SupportPoint Cone::core_support(const Vector3& direction) const {
  const Vector3 rim = geometry_internal::rim_towards(direction, radius_, -half_length_);
  const Vector3 tip(0, 0, half_length_);
  return {direction.dot(tip) >= direction.dot(rim) ? tip : rim, std::nullopt};
}

FlatPart Cone::flat_part(const Vector3& unit_direction, Scalar sine) const {
  if (unit_direction.z() < 0 && unit_direction.head<2>().norm() <= sine) {
    return {FlatPart::Kind::Disc, Vector3(0, 0, -half_length_), -Vector3::UnitZ(), radius_};
  }
  const Vector3 rim = geometry_internal::rim_towards(unit_direction, radius_, -half_length_);
  const Vector3 half_side = (Vector3(0, 0, half_length_) - rim) / 2;
  if (!(std::abs(unit_direction.dot(half_side)) <= sine * half_side.norm())) return {};
  return {FlatPart::Kind::Segment, rim + half_side, half_side, 0};
}

AlignedBox Cone::bounding_box() const {
  const Vector3 half(radius_, radius_, half_length_);
  return {-half, half};
}

Scalar Cone::bounding_radius() const {
  return geometry_internal::length_up(radius_, half_length_);
}

// The centre of mass is a quarter of the height above the base.
MassProperties Cone::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  const Scalar r_sq = radius_ * radius_;
  const Scalar h = half_length_;
  MassProperties properties;
  properties.mass = density * (2 * std::numbers::pi / 3) * r_sq * h;
  properties.p_BoBcm = Vector3(0, 0, -h / 2);
  const Scalar transverse = properties.mass * 3 * (r_sq + h * h) / 20;
  properties.I_BBcm = Vector3(transverse, transverse, properties.mass * 3 * r_sq / 10).asDiagonal();
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
