// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/rounded_box.h"

#include <numbers>
#include <utility>

#include "geometry/solid.h"

namespace dyop {

RoundedBox::RoundedBox(const Vector3& half_extents, Scalar radius)
    : RoundedBox(Box(half_extents), radius) {}

RoundedBox::RoundedBox(Box&& core, Scalar radius)
    : ConvexShape({.kind = CoreKind::Box,
                   .rounding_radius = radius,
                   .bounding_radius = (core.bounding_radius() + radius) * (1 + 4 * kUnitRoundoff),
                   .half_extents = core.half_extents()}),
      core_(std::move(core)),
      radius_(radius) {
  geometry_internal::require_length("radius", radius);
}

AlignedBox RoundedBox::bounding_box() const {
  const Vector3 half = (half_extents() + Vector3::Constant(radius_)) * (1 + 4 * kUnitRoundoff);
  return {-half, half};
}

namespace {

// The volume of a rounded box, and the integral of each coordinate squared over it.
struct OctantMoments {
  Scalar volume = 0;
  Vector3 squares = Vector3::Zero();

  // Both halves of a part that is the same on either side along axis k: this volume in all, its
  // middle at the distance `away` from the origin, and this variance along k.
  void add(Scalar part, const Vector3& away, const Vector3& variance) {
    volume += part;
    squares += part * (away.cwiseAbs2() + variance);
  }
};

}  // namespace

// Over any of the eight octants the shape is a box, three slabs, three quarters of a cylinder, and
// an eighth of a ball. A quarter disc's centre of mass is 4r/(3 pi) from either side and its
// variance r^2 (1/4 - 16/(9 pi^2)); an eighth of a ball's 3r/8 and r^2 (1/5 - 9/64).
MassProperties RoundedBox::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  constexpr Scalar kPi = std::numbers::pi;
  const Vector3 h = half_extents();
  const Scalar r = radius_;
  const Vector3 inner_variance = h.cwiseAbs2() / 12;
  OctantMoments moments;
  moments.add(8 * h.prod(), h / 2, inner_variance);
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;
    Vector3 middle = h / 2;
    Vector3 variance = inner_variance;
    middle[k] = h[k] + r / 2;
    variance[k] = r * r / 12;
    moments.add(8 * h[i] * h[j] * r, middle, variance);
    // The rounded edges parallel to k.
    for (const int across : {i, j}) {
      middle[across] = h[across] + 4 * r / (3 * kPi);
      variance[across] = r * r * (Scalar(1) / 4 - 16 / (9 * kPi * kPi));
    }
    middle[k] = h[k] / 2;
    variance[k] = inner_variance[k];
    moments.add(2 * kPi * r * r * h[k], middle, variance);
  }
  moments.add(4 * kPi / 3 * r * r * r, h + Vector3::Constant(3 * r / 8),
              Vector3::Constant(r * r * (Scalar(1) / 5 - Scalar(9) / 64)));
  MassProperties properties;
  properties.mass = density * moments.volume;
  const Vector3& sq = moments.squares;
  properties.I_BBcm =
      (density * Vector3(sq.y() + sq.z(), sq.z() + sq.x(), sq.x() + sq.y())).asDiagonal();
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
