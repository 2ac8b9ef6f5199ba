// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/body_record.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/geometry/half_space.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::dynamics_internal {
namespace {

void require_mass(const BodyDefinition& body) {
  const auto& name = body.name;
  const MassProperties& properties = body.mass_properties;
  DYOP_REQUIRE(properties.mass > 0 && properties.mass < kInfinity, "body '", name,
               "': mass must be finite and > 0, not ", properties.mass);
  DYOP_REQUIRE(properties.p_BoBcm.allFinite(), "body '", name, "': centre of mass must be finite");
  const Matrix3& I = properties.I_BBcm;
  DYOP_REQUIRE(I.allFinite() && I.isApprox(I.transpose()), "body '", name,
               "': inertia must be finite and symmetric");
  const Vector3 principal = Eigen::SelfAdjointEigenSolver<Matrix3>(I).eigenvalues();
  DYOP_REQUIRE(principal[0] > 0, "body '", name,
               "': inertia must be positive definite, but has principal moment ", principal[0]);
}

// Largest distance of a point of the shape from p, both in B.
Scalar radius_about(const Shape& shape, const Vector3& p_BoP) {
  const AlignedBox box = shape.bounding_box();
  const Vector3 farthest = (box.min() - p_BoP).cwiseAbs().cwiseMax((box.max() - p_BoP).cwiseAbs());
  // literal: generous for rounding, at no cost
  return (1 + 1e-12) * std::min(farthest.norm(), shape.bounding_radius() + p_BoP.norm());
}

Vector3 free_axes(const std::array<bool, 3>& locked) {
  return Vector3(locked[0] ? 0 : 1, locked[1] ? 0 : 1, locked[2] ? 0 : 1);
}

}  // namespace

void require_material(const BodyDefinition& body) {
  const auto& name = body.name;
  DYOP_REQUIRE(body.restitution >= 0 && body.restitution <= 1, "body '", name,
               "': restitution must be in [0, 1], not ", body.restitution);
  const auto require_coefficient = [&](Scalar value, const char* what) {
    DYOP_REQUIRE(value >= 0 && value < kInfinity, "body '", name, "': ", what,
                 " must be finite and >= 0, not ", value);
  };
  require_coefficient(body.friction, "friction");
  require_coefficient(body.rolling_friction, "rolling friction");
  require_coefficient(body.torsional_friction, "torsional friction");
}

void require_valid(const BodyDefinition& body) {
  const auto& name = body.name;
  DYOP_REQUIRE(body.shape != nullptr, "body '", name, "': shape is missing");
  require_material(body);
  DYOP_REQUIRE(body.initial.twist.v_WB.allFinite() && body.initial.twist.w_WB.allFinite(), "body '",
               name, "': initial velocity must be finite");
  if (body.kind == BodyKind::Kinematic) {
    DYOP_REQUIRE(body.motion != nullptr, "body '", name, "': a kinematic body needs a motion");
  }
  if (body.kind != BodyKind::Dynamic) {
    DYOP_REQUIRE(!body.wrench, "body '", name, "': only a dynamic body can have a wrench");
    DYOP_REQUIRE(!body.locked.any(), "body '", name, "': only a dynamic body can have locked axes");
    return;
  }
  DYOP_REQUIRE(!as_half_space(*body.shape), "body '", name,
               "': a half-space must be static or kinematic, not dynamic");
  require_mass(body);
}

BodyRecord make_body_record(BodyId id, const BodyDefinition& definition, Scalar t) {
  BodyRecord body;
  body.id = id;
  body.definition = definition;
  MassProperties& properties = body.definition.mass_properties;
  if (!body.is_dynamic()) properties = MassProperties{};
  body.radius_B = definition.shape->bounding_radius();
  body.box_B = definition.shape->bounding_box();
  body.size = definition.shape->size();
  body.radius = radius_about(*definition.shape, properties.p_BoBcm);
  MotionState start = definition.initial;
  if (definition.kind == BodyKind::Static) start.twist = {};
  if (definition.kind == BodyKind::Kinematic) {
    DYOP_REQUIRE(definition.motion->domain().contains(t), "body '", definition.name,
                 "': its motion is not defined at the time ", t);
    start = definition.motion->state(t);
  }
  if (body.is_dynamic()) {
    body.inverse_mass = 1 / properties.mass;
    body.inertia_B = properties.I_BBcm;
    body.inverse_inertia_B = properties.I_BBcm.inverse();
  }
  body.state = central_state(body, start);
  body.rest = std::make_shared<RestMotion>(start.X_WB);
  return body;
}

RigidPose BodyRecord::X_WB() const {
  const Matrix3& R = state.X_WM.rotation();
  return RigidPose::from_trusted(R,
                                 state.X_WM.translation() - R * definition.mass_properties.p_BoBcm);
}

MotionState BodyRecord::motion_state() const {
  if (definition.kind == BodyKind::Kinematic) return {X_WB(), {state.v_W, state.L_W}};
  return dynamics_internal::motion_state(definition.mass_properties, state.X_WM, state.v_W,
                                         angular_velocity());
}

Matrix3 BodyRecord::linear_mobility() const {
  return (inverse_mass * free_axes(definition.locked.translation)).asDiagonal();
}

Matrix3 BodyRecord::angular_mobility(const Matrix3& R_WB) const {
  if (!definition.locked.any_rotation()) return R_WB * inverse_inertia_B * R_WB.transpose();
  const auto& locked = definition.locked.rotation;
  // On the free axes: the inverse of that part of the inertia. On the others: zero.
  Matrix3 inertia = R_WB * inertia_B * R_WB.transpose();
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (!locked[static_cast<std::size_t>(k)]) continue;
    inertia.row(k).setZero();
    inertia.col(k).setZero();
    inertia(k, k) = 1;
  }
  Matrix3 mobility = inertia.inverse();
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (locked[static_cast<std::size_t>(k)]) mobility(k, k) = 0;
  }
  return mobility;
}

Vector3 BodyRecord::angular_velocity(const Matrix3& R_WB, const Vector3& L_W) const {
  if (definition.locked.any_rotation()) return angular_mobility(R_WB) * L_W;
  const Vector3 L_B = R_WB.transpose() * L_W;
  return R_WB * (inverse_inertia_B * L_B);
}

Scalar BodyRecord::kinetic_energy() const {
  if (!is_dynamic()) return 0;
  return (state.v_W.squaredNorm() / inverse_mass + angular_velocity().dot(state.L_W)) / 2;
}

CentralState central_state(const BodyRecord& body, const MotionState& state) {
  const MassProperties& properties = body.definition.mass_properties;
  const Matrix3& R = state.X_WB.rotation();
  const Vector3 p_BoBcm_W = R * properties.p_BoBcm;
  CentralState result;
  result.X_WM = RigidPose::from_trusted(R, state.X_WB.translation() + p_BoBcm_W);
  result.v_W = state.twist.v_WB + state.twist.w_WB.cross(p_BoBcm_W);
  if (!body.is_dynamic()) {  // without inertia: this holds its angular velocity
    result.L_W = state.twist.w_WB;
    return result;
  }
  const LockedAxes& locked = body.definition.locked;
  result.v_W = result.v_W.cwiseProduct(free_axes(locked.translation));
  const Vector3 w = state.twist.w_WB.cwiseProduct(free_axes(locked.rotation));
  result.L_W = (R * body.inertia_B * R.transpose() * w).cwiseProduct(free_axes(locked.rotation));
  return result;
}

MotionState motion_state(const MassProperties& properties, const RigidPose& X_WM,
                         const Vector3& v_W, const Vector3& w_W) {
  const Matrix3& R = X_WM.rotation();
  const Vector3 p_BoBcm_W = R * properties.p_BoBcm;
  return {RigidPose::from_trusted(R, X_WM.translation() - p_BoBcm_W),
          Twist{v_W - w_W.cross(p_BoBcm_W), w_W}};
}

Wrench total_wrench(const BodyRecord& body, const Vector3& gravity_W, Scalar t,
                    const MotionState& state) {
  Wrench sum{body.definition.mass_properties.mass * gravity_W, Vector3::Zero()};
  if (body.definition.wrench) {
    const Wrench user = body.definition.wrench(t, state);
    if (!user.force.allFinite() || !user.torque.allFinite()) {
      throw IntegrationError(compose_message(
          "body '", body.definition.name, "': its wrench callback returned force (",
          user.force.transpose(), "), torque (", user.torque.transpose(), ") at t = ", t));
    }
    sum.force += user.force;
    sum.torque += user.torque;
  }
  sum.force = sum.force.cwiseProduct(free_axes(body.definition.locked.translation));
  sum.torque = sum.torque.cwiseProduct(free_axes(body.definition.locked.rotation));
  return sum;
}

std::shared_ptr<const Motion> about_center(const BodyRecord& body,
                                           std::shared_ptr<const Motion> X_WM) {
  const Vector3& p_BoBcm = body.definition.mass_properties.p_BoBcm;
  if (p_BoBcm.isZero(0)) return X_WM;
  return std::make_shared<ComposedMotion>(
      std::move(X_WM), std::make_shared<RestMotion>(RigidPose(Vector3(-p_BoBcm))));
}

}  // namespace dyop::dynamics_internal
