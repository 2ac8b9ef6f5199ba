// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/capsule.h"

#include <numbers>

#include "geometry/solid.h"

namespace dyop {
namespace {

void require_half_length(Scalar half_length) {
  DYOP_REQUIRE(half_length >= 0 && half_length <= kLargestCoordinate,
               "half length of a capsule must be >= 0 and at most ", kLargestCoordinate, ", not ",
               half_length);
}

TriangleMesh segment_on_z(Scalar half_length) {
  return TriangleMesh({Vector3(0, 0, -half_length), Vector3(0, 0, half_length)}, {{0, 1, 1}});
}

// The sum rounded up: one addition errs by at most u relative.
Scalar sum_up(Scalar a, Scalar b) {
  return (a + b) * (1 + 4 * kUnitRoundoff);
}

}  // namespace

Capsule::Capsule(Scalar radius, Scalar half_length)
    : ConvexShape({.kind = CoreKind::Segment,
                   .rounding_radius = radius,
                   .bounding_radius = sum_up(radius, half_length),
                   .half_extents = Vector3(0, 0, half_length)}),
      radius_(radius),
      half_length_(half_length),
      segment_(std::make_shared<const geometry_internal::SurfaceOnDemand>()) {
  require_half_length(half_length);
  geometry_internal::require_length("radius", radius);
}

const TriangleMesh* Capsule::core_surface() const {
  return &segment_->get([this] { return segment_on_z(half_length_); });
}

SupportPoint Capsule::core_support(const Vector3& direction) const {
  if (direction.z() >= 0) return {Vector3(0, 0, half_length_), 1};
  return {Vector3(0, 0, -half_length_), 0};
}

AlignedBox Capsule::bounding_box() const {
  const Vector3 half(radius_, radius_, sum_up(radius_, half_length_));
  return {-half, half};
}

Scalar Capsule::bounding_radius() const {
  return sum_up(radius_, half_length_);
}

MassProperties Capsule::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  // A cylinder of length 2h and two half balls, whose centres of mass lie 3r/8 beyond its ends; a
  // half ball's transverse moment about the centre of its flat side is 2/5 m r^2, like a whole
  // ball's.
  const Scalar r = radius_;
  const Scalar h = half_length_;
  const Scalar cylinder = density * (2 * std::numbers::pi) * r * r * h;
  const Scalar ball = density * (4 * std::numbers::pi / 3) * r * r * r;
  const Scalar axial = cylinder * r * r / 2 + ball * 2 * r * r / 5;
  const Scalar transverse =
      cylinder * (r * r / 4 + h * h / 3) + ball * (2 * r * r / 5 + h * h + 3 * r * h / 4);
  MassProperties properties;
  properties.mass = cylinder + ball;
  properties.I_BBcm = Vector3(transverse, transverse, axial).asDiagonal();
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
