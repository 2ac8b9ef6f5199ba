// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/box.h"

#include <cmath>

#include "geometry/solid.h"

namespace dyop {
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
  // Two triangles per face, counterclockwise seen from outside: -x, +x, -y, +y, -z, +z.
  return TriangleMesh(std::move(vertices), {{0, 4, 6},
                                            {0, 6, 2},
                                            {1, 3, 7},
                                            {1, 7, 5},
                                            {0, 1, 5},
                                            {0, 5, 4},
                                            {2, 6, 7},
                                            {2, 7, 3},
                                            {0, 2, 3},
                                            {0, 3, 1},
                                            {4, 5, 7},
                                            {4, 7, 6}});
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

}  // namespace dyop
