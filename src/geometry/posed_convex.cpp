// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/posed_convex.h"

#include <algorithm>

#include "core/tolerance.h"

namespace dyop::geometry_internal {

MassProperties posed(const MassProperties& properties, const RigidPose& X_CS) {
  const Matrix3& R_CS = X_CS.rotation();
  return {properties.mass, X_CS * properties.p_BoBcm, R_CS * properties.I_BBcm * R_CS.transpose()};
}

std::vector<Vector3> posed_vertices(const TriangleMesh& mesh, const RigidPose& X_CS) {
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& vertex : vertices) vertex = X_CS * vertex;
  return vertices;
}

namespace {

// A box keeps its closed forms only in its own frame.
SimpleCore posed_core(const ConvexShape& shape, const RigidPose& X_CS) {
  SimpleCore core = shape.simple_core();
  if (core.kind == CoreKind::Box) core.kind = CoreKind::General;
  if (core.kind == CoreKind::General) return core;
  core.center = X_CS * core.center;
  core.half_extents = X_CS.rotation() * core.half_extents;
  core.is_centred = false;
  core.bounding_radius =
      (X_CS.translation().norm() + core.bounding_radius) * (1 + 8 * kUnitRoundoff);
  return core;
}

}  // namespace

PosedConvex::PosedConvex(std::shared_ptr<const ConvexShape> shape, const RigidPose& X_CS)
    : ConvexShape(posed_core(*shape, X_CS)), shape_(std::move(shape)), X_CS_(X_CS) {
  if (const TriangleMesh* surface = shape_->core_surface()) {
    surface_ = surface->with_vertices(posed_vertices(*surface, X_CS_));
  }
}

OrientedBox PosedConvex::box() const {
  const AlignedBox bounds = shape_->bounding_box();
  OrientedBox box;
  box.center = X_CS_ * bounds.center();
  box.axes = X_CS_.rotation();
  const Scalar size =
      X_CS_.translation().norm() + bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).norm();
  box.half_extents = (bounds.sizes() / 2).array() + kBoxNoise * size;
  return box;
}

AlignedBox PosedConvex::bounding_box() const {
  const OrientedBox turned = box();
  const Scalar noise = kBoxNoise * (turned.center.norm() + turned.half_extents.norm());
  const Vector3 reach = (turned.axes.cwiseAbs() * turned.half_extents).array() + noise;
  return {turned.center - reach, turned.center + reach};
}

Scalar PosedConvex::bounding_radius() const {
  const Scalar by_center = X_CS_.translation().norm() + shape_->bounding_radius();
  const OrientedBox turned = box();
  // A corner's coordinates along the axes of the box.
  const Vector3 middle = turned.axes.transpose() * turned.center;
  const Scalar by_corner = (middle.cwiseAbs() + turned.half_extents).norm();
  return std::min(by_center, by_corner) * (1 + kBoxNoise);
}

MassProperties PosedConvex::compute_mass_properties(Scalar density) const {
  return posed(shape_->compute_mass_properties(density), X_CS_);
}

}  // namespace dyop::geometry_internal
