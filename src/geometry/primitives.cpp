// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/box_surface.h"
#include "geometry/solid.h"

namespace dyop::geometry_internal {

/// The point of a horizontal circle about the z axis that is farthest along a direction; the centre
/// if there is none. The part of the direction in the plane is divided by its larger coordinate, so
/// that nothing over- or underflows.
inline Vector3 rim_towards(const Vector3& direction, Scalar radius, Scalar height) {
  const Scalar size = std::max(std::abs(direction.x()), std::abs(direction.y()));
  if (!(size > 0)) return {0, 0, height};
  const Scalar x = direction.x() / size;
  const Scalar y = direction.y() / size;
  const Scalar scale = radius / std::sqrt(x * x + y * y);
  return {x * scale, y * scale, height};
}

/// The length of (x, y), rounded up: squares, sum and root err by less than 4u.
inline Scalar length_up(Scalar x, Scalar y) {
  const Scalar size = std::max(x, y);
  const Scalar a = x / size;
  const Scalar b = y / size;
  return size * std::sqrt(a * a + b * b) * (1 + 8 * kUnitRoundoff);
}

/// The mass of a solid of revolution about the z axis, whose outline is integrated piece by piece.
class Revolution {
 public:
  /// Adds the part of the outline over [from, to] of a parameter at which z, the squared radius and
  /// dz are given. Exact up to rounding for polynomials of degree 9.
  template <typename Outline>
  void add(Scalar from, Scalar to, const Outline& outline) {
    // Nodes and weights of Gauss and Legendre.
    static constexpr std::array<Scalar, 5> kNodes{0, -0.53846931010568309104,
                                                  0.53846931010568309104, -0.90617984593866399280,
                                                  0.90617984593866399280};
    static constexpr std::array<Scalar, 5> kWeights{0.56888888888888888889, 0.47862867049936646804,
                                                    0.47862867049936646804, 0.23692688505618908751,
                                                    0.23692688505618908751};
    for (std::size_t k = 0; k < kNodes.size(); ++k) {
      const Scalar x = (from + to) / 2 + (to - from) / 2 * kNodes[k];
      const auto [z, radius_sq, dz] = outline(x);
      const Scalar slice = kWeights[k] * (to - from) / 2 * dz * std::numbers::pi * radius_sq;
      volume_ += slice;
      first_ += slice * z;
      axial_ += slice * radius_sq / 2;
      across_ += slice * (radius_sq / 4 + z * z);
    }
  }

  MassProperties mass_properties(Scalar density) const {
    const Scalar middle = first_ / volume_;
    const Scalar across = across_ - volume_ * middle * middle;
    MassProperties properties;
    properties.mass = density * volume_;
    properties.p_BoBcm = Vector3(0, 0, middle);
    properties.I_BBcm = (density * Vector3(across, across, axial_)).asDiagonal();
    return require_representable(properties);
  }

 private:
  Scalar volume_ = 0;
  Scalar first_ = 0;  // integrals of z, of half the squared radius, and of x^2 + z^2
  Scalar axial_ = 0;
  Scalar across_ = 0;
};

/// What an outline gives: height, squared radius, and how fast the height changes.
struct OutlinePoint {
  Scalar z;
  Scalar radius_sq;
  Scalar dz;
};

}  // namespace dyop::geometry_internal

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

Ellipsoid::Ellipsoid(const Vector3& semi_axes) : semi_axes_(semi_axes) {
  for (int k = 0; k < 3; ++k) {
    geometry_internal::require_length("semi-axis of an ellipsoid", semi_axes[k]);
  }
}

// The image of a unit ball: its farthest point along d is that of the ball along A d, mapped by A.
SupportPoint Ellipsoid::core_support(const Vector3& direction) const {
  const Vector3 mapped = semi_axes_.cwiseProduct(direction / semi_axes_.maxCoeff());
  // Divided by its largest part, so that nothing over- or underflows.
  const Scalar size = mapped.cwiseAbs().maxCoeff();
  if (!(size > 0)) return {Vector3(0, 0, semi_axes_.z()), std::nullopt};
  return {semi_axes_.cwiseProduct((mapped / size).normalized()), std::nullopt};
}

MassProperties Ellipsoid::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  const Vector3 sq = semi_axes_.cwiseAbs2();
  MassProperties properties;
  properties.mass = density * (4 * std::numbers::pi / 3) * semi_axes_.prod();
  const Vector3 moments(sq.y() + sq.z(), sq.z() + sq.x(), sq.x() + sq.y());
  properties.I_BBcm = (moments * (properties.mass / 5)).asDiagonal();
  return geometry_internal::require_representable(properties);
}

namespace {

Vector3 corner(const Vector3& half_extents, std::int32_t number) {
  Vector3 p = half_extents;
  for (int k = 0; k < 3; ++k) {
    if ((number >> k & 1) == 0) p[k] = -p[k];
  }
  return p;
}

// The length of the half diagonal, rounded up: scaling, three squares and sums, and the root err by
// less than 8u.
Scalar radius_of_box(const Vector3& half_extents) {
  for (int k = 0; k < 3; ++k)
    geometry_internal::require_length("half extent of a box", half_extents[k]);
  const Scalar scale = half_extents.maxCoeff();
  return std::nextafter(scale * (half_extents / scale).norm() * (1 + 16 * kUnitRoundoff),
                        kInfinity);
}

TriangleMesh surface_of_box(const Vector3& half_extents) {
  std::vector<Vector3> vertices;
  for (std::int32_t number = 0; number < 8; ++number) {
    vertices.push_back(corner(half_extents, number));
  }
  const auto& triangles = geometry_internal::kBoxTriangles;
  return TriangleMesh(std::move(vertices), {triangles.begin(), triangles.end()});
}

}  // namespace

Box::Box(const Vector3& half_extents)
    : ConvexShape({.kind = CoreKind::Box,
                   .bounding_radius = radius_of_box(half_extents),
                   .half_extents = half_extents}),
      half_extents_(half_extents),
      surface_(std::make_shared<const geometry_internal::SurfaceOnDemand>()) {}

const TriangleMesh* Box::core_surface() const {
  return &surface_->get([this] { return surface_of_box(half_extents_); });
}

SupportPoint Box::core_support(const Vector3& direction) const {
  // Signs are random, so no branches on them.
  Vector3 corner;
  std::int32_t vertex = 0;
  for (int k = 0; k < 3; ++k) {
    corner[k] = std::copysign(half_extents_[k], direction[k]);
    vertex |= static_cast<std::int32_t>(!std::signbit(direction[k])) << k;
  }
  return {corner, vertex};
}

MassProperties Box::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  MassProperties properties;
  const Vector3& h = half_extents_;
  properties.mass = density * (8 * h.x() * h.y() * h.z());
  const Vector3 sq = h.cwiseAbs2();
  const Vector3 moments(sq.y() + sq.z(), sq.z() + sq.x(), sq.x() + sq.y());
  properties.I_BBcm = (moments * (properties.mass / 3)).asDiagonal();
  return geometry_internal::require_representable(properties);
}

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
