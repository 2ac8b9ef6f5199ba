// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/tapered_capsule.h"

#include <algorithm>
#include <cmath>

#include "geometry/revolution.h"
#include "geometry/solid.h"

namespace dyop {

TaperedCapsule::TaperedCapsule(Scalar bottom_radius, Scalar top_radius, Scalar half_length)
    : bottom_radius_(bottom_radius), top_radius_(top_radius), half_length_(half_length) {
  geometry_internal::require_length("bottom radius", bottom_radius);
  geometry_internal::require_length("top radius", top_radius);
  geometry_internal::require_length("half length of a tapered capsule", half_length);
  DYOP_REQUIRE(std::abs(bottom_radius - top_radius) < 2 * half_length,
               "one ball of a tapered capsule holds the other: radii ", bottom_radius, " and ",
               top_radius, ", half length ", half_length);
}

SupportPoint TaperedCapsule::core_support(const Vector3& direction) const {
  const Scalar size = direction.cwiseAbs().maxCoeff();
  if (!(size > 0)) return {core_center(), std::nullopt};
  const Vector3 w = direction / size;
  const Vector3 u = w / w.norm();
  const bool is_top = half_length_ * u.z() + top_radius_ > bottom_radius_ - half_length_ * u.z();
  const Vector3 center(0, 0, is_top ? half_length_ : -half_length_);
  return {center + (is_top ? top_radius_ : bottom_radius_) * u, std::nullopt};
}

Vector3 TaperedCapsule::core_center() const {
  return {0, 0, (top_radius_ - bottom_radius_) / 2};
}

// The side's outward normals all lean by the angle with this sine, so that both balls are equally
// far along them.
FlatPart TaperedCapsule::flat_part(const Vector3& unit_direction, Scalar sine) const {
  const Scalar lean = (bottom_radius_ - top_radius_) / (2 * half_length_);
  const Scalar flat = std::sqrt((1 - lean) * (1 + lean));
  const Scalar across = unit_direction.head<2>().norm();
  if (!(across > 0) || !(flat * across + lean * unit_direction.z() > 0)) return {};
  if (!(std::abs(flat * unit_direction.z() - lean * across) <= sine)) return {};
  const Vector3 normal(flat * unit_direction.x() / across, flat * unit_direction.y() / across,
                       lean);
  const Vector3 up(0, 0, half_length_);
  const Vector3 half_side = up + (top_radius_ - bottom_radius_) / 2 * normal;
  const Vector3 center = (top_radius_ + bottom_radius_) / 2 * normal;
  return {FlatPart::Kind::Segment, center, half_side, 0};
}

AlignedBox TaperedCapsule::bounding_box() const {
  constexpr Scalar kUp = 1 + 4 * kUnitRoundoff;
  const Scalar across = kUp * std::max(bottom_radius_, top_radius_);
  return {Vector3(-across, -across, -kUp * (half_length_ + bottom_radius_)),
          Vector3(across, across, kUp * (half_length_ + top_radius_))};
}

Scalar TaperedCapsule::bounding_radius() const {
  return (half_length_ + std::max(bottom_radius_, top_radius_)) * (1 + 4 * kUnitRoundoff);
}

// A part of a ball below its circle of contact with the side, a part of a cone, and a part of a
// ball above.
MassProperties TaperedCapsule::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  using geometry_internal::OutlinePoint;
  const Scalar h = half_length_;
  const Scalar lean = (bottom_radius_ - top_radius_) / (2 * h);
  const Scalar flat = std::sqrt((1 - lean) * (1 + lean));
  const auto ball = [](Scalar center, Scalar radius) {
    return [=](Scalar z) {
      return OutlinePoint{z, (radius - (z - center)) * (radius + (z - center)), 1};
    };
  };
  const Scalar low = lean * bottom_radius_ - h;
  const Scalar high = lean * top_radius_ + h;
  const auto cone = [&](Scalar z) {
    const Scalar share = (z - low) / (high - low);
    const Scalar r = flat * (bottom_radius_ + share * (top_radius_ - bottom_radius_));
    return OutlinePoint{z, r * r, 1};
  };
  geometry_internal::Revolution solid;
  solid.add(-h - bottom_radius_, low, ball(-h, bottom_radius_));
  solid.add(low, high, cone);
  solid.add(high, h + top_radius_, ball(h, top_radius_));
  return solid.mass_properties(density);
}

}  // namespace dyop
