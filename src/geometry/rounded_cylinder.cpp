// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/rounded_cylinder.h"

#include <cmath>
#include <numbers>

#include "geometry/revolution.h"
#include "geometry/solid.h"

namespace dyop {

RoundedCylinder::RoundedCylinder(Scalar radius, Scalar half_length, Scalar edge_radius)
    : core_(radius, half_length), edge_radius_(edge_radius) {
  geometry_internal::require_length("edge radius", edge_radius);
}

AlignedBox RoundedCylinder::bounding_box() const {
  const Vector3 half =
      (core_.bounding_box().max() + Vector3::Constant(edge_radius_)) * (1 + 4 * kUnitRoundoff);
  return {-half, half};
}

Scalar RoundedCylinder::bounding_radius() const {
  return (core_.bounding_radius() + edge_radius_) * (1 + 4 * kUnitRoundoff);
}

// A cylinder between two rounded caps, whose outline is an arc. Its trigonometric polynomials are
// smooth: the rule is exact up to rounding over so many parts.
MassProperties RoundedCylinder::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  using geometry_internal::OutlinePoint;
  constexpr int kParts = 16;
  const Scalar h = half_length();
  const Scalar r = edge_radius_;
  const auto arc = [&](Scalar angle) {
    const Scalar across = radius() + r * std::cos(angle);
    const Scalar up = angle > 0 ? h : -h;
    return OutlinePoint{up + r * std::sin(angle), across * across, r * std::cos(angle)};
  };
  const auto side = [&](Scalar z) { return OutlinePoint{z, (radius() + r) * (radius() + r), 1}; };
  geometry_internal::Revolution solid;
  solid.add(-h, h, side);
  for (int k = 0; k < kParts; ++k) {
    const Scalar from = std::numbers::pi / 2 * k / kParts;
    const Scalar to = std::numbers::pi / 2 * (k + 1) / kParts;
    solid.add(from, to, arc);
    solid.add(-to, -from, arc);
  }
  return solid.mass_properties(density);
}

}  // namespace dyop
