// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/half_space.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

Vector3 unit_normal(const Vector3& normal) {
  DYOP_REQUIRE(normal.allFinite() && normal.cwiseAbs().maxCoeff() > 0,
               "the normal of a half-space must be finite and not zero, not (", normal.transpose(),
               ")");
  return normal.stableNormalized();
}

// Where the plane cuts a ball.
Scalar rim_radius(Scalar radius, Scalar offset) {
  return std::sqrt((radius - offset) * (radius + offset));
}

}  // namespace

HalfSpace::HalfSpace(const Vector3& normal, Scalar offset)
    : ConvexShape({.kind = CoreKind::HalfSpace, .bounding_radius = kLargestCoordinate}),
      normal_(unit_normal(normal)),
      offset_(offset),
      radius_(kLargestCoordinate) {
  DYOP_REQUIRE(std::abs(offset) <= kLargestCoordinate / 2, "the offset of a half-space must be ",
               "at most ", kLargestCoordinate / 2, ", not ", offset);
}

HalfSpace HalfSpace::within(Scalar radius) const {
  HalfSpace part = *this;
  const Scalar wanted = radius + 2 * std::abs(offset_);
  constexpr Scalar kLeast = std::numeric_limits<Scalar>::min();
  part.radius_ =
      wanted < kLargestCoordinate ? std::max(wanted, kLeast) : kLargestCoordinate;  // NaN
  return part;
}

// The half-space within a ball: the farthest point is one of the ball, or of the rim where the
// plane cuts it.
SupportPoint HalfSpace::core_support(const Vector3& direction) const {
  const Scalar size = direction.cwiseAbs().maxCoeff();
  if (!(size > 0)) return {core_center(), std::nullopt};
  const Vector3 w = direction / size;
  const Scalar length = w.norm();
  if (radius_ * normal_.dot(w) <= offset_ * length) {
    return {w * (radius_ / length), std::nullopt};
  }
  const Vector3 across = w.cross(normal_);  // exactly zero along the normal
  const Scalar sine = across.norm();
  Vector3 p = offset_ * normal_;
  if (sine > 0) p += normal_.cross(across) * (rim_radius(radius_, offset_) / sine);
  return {p, std::nullopt};
}

Scalar HalfSpace::core_reach(const Vector3& direction) const {
  const Scalar along = normal_.dot(direction);
  const Scalar length = direction.norm();
  if (radius_ * along <= offset_ * length) return radius_ * length;
  return offset_ * along + rim_radius(radius_, offset_) * direction.cross(normal_).norm();
}

FlatPart HalfSpace::flat_part(const Vector3& unit_direction, Scalar sine) const {
  if (!(normal_.dot(unit_direction) > 0) || unit_direction.cross(normal_).norm() > sine) return {};
  return {FlatPart::Kind::Disc, offset_ * normal_, normal_, rim_radius(radius_, offset_)};
}

AlignedBox HalfSpace::bounding_box() const {
  constexpr Scalar kUp = 1 + 8 * kUnitRoundoff;
  const Scalar noise = 8 * kUnitRoundoff * radius_;
  Vector3 low, high;
  for (int k = 0; k < 3; ++k) {
    const Vector3 axis = Vector3::Unit(k);
    const bool is_normal = normal_.cross(axis).isZero(0);
    high[k] = core_reach(axis);
    low[k] = -core_reach(-axis);
    if (!is_normal || normal_[k] < 0) high[k] = std::min(radius_ * kUp, high[k] + noise);
    if (!is_normal || normal_[k] > 0) low[k] = std::max(-radius_ * kUp, low[k] - noise);
  }
  return {low, high};
}

MassProperties HalfSpace::compute_mass_properties(Scalar /*density*/) const {
  throw InvalidArgument("a half-space has no finite mass: its body must be static or kinematic");
}

}  // namespace dyop
