// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/dynamics/rigid_body.h"

namespace dyop::dynamics_internal {

class FreeFlight;

/// State of a body about its centre of mass: M is the frame there with the axes of B.
struct CentralState {
  RigidPose X_WM;
  Vector3 v_W = Vector3::Zero();  // of the centre of mass
  Vector3 L_W = Vector3::Zero();  // angular momentum about it
};

/// A body prepared for stepping; constant except for the wrench and a kinematic motion.
struct BodyRecord {
  BodyId id;
  BodyDefinition definition;
  bool exists = true;
  bool is_enabled = true;
  bool is_asleep = false;
  int slow_steps = 0;

  Scalar radius = 0;  // largest distance of a point of the shape from the centre of mass
  // Cached from the shape: the virtual calls would dominate free flight.
  Scalar radius_B = 0;
  Scalar size = 0;  // what default lengths go by
  AlignedBox box_B;
  Matrix3 inertia_B = Matrix3::Zero();
  Matrix3 inverse_inertia_B = Matrix3::Zero();
  Scalar inverse_mass = 0;

  CentralState state;
  Wrench wrench_asleep;                // from the user's callback when the body fell asleep
  std::shared_ptr<const Motion> rest;  // at the pose of `state`; for a body at rest
  std::shared_ptr<FreeFlight> flight;  // null: to be started from `state`

  bool is_present() const { return exists && is_enabled; }
  bool is_dynamic() const { return definition.kind == BodyKind::Dynamic; }
  /// Stepped: dynamic, present, and not asleep.
  bool is_awake() const { return is_present() && is_dynamic() && !is_asleep; }

  RigidPose X_WB() const;
  MotionState motion_state() const;
  Matrix3 linear_mobility() const;
  /// w = angular_mobility(R) L, also valid with locked axes.
  Matrix3 angular_mobility(const Matrix3& R_WB) const;
  /// angular_mobility(R_WB) L_W, without the matrix if no axis is locked.
  Vector3 angular_velocity(const Matrix3& R_WB, const Vector3& L_W) const;
  Vector3 angular_velocity() const { return angular_velocity(state.X_WM.rotation(), state.L_W); }
  Scalar kinetic_energy() const;
};

/// @throws InvalidArgument naming body and field.
void require_valid(const BodyDefinition& definition);

/// Checks its restitution and friction alone.
void require_material(const BodyDefinition& definition);

/// The record of a valid definition at time t.
BodyRecord make_body_record(BodyId id, const BodyDefinition& definition, Scalar t);

CentralState central_state(const BodyRecord& body, const MotionState& state);
MotionState motion_state(const MassProperties& properties, const RigidPose& X_WM,
                         const Vector3& v_W, const Vector3& w_W);

/// The body's own wrench plus gravity, along its free axes only.
/// @throws IntegrationError naming the body if its callback returns numbers that are not finite.
Wrench total_wrench(const BodyRecord& body, const Vector3& gravity_W, Scalar t,
                    const MotionState& state);

/// Converts a motion of the centre of mass to one of the frame B.
std::shared_ptr<const Motion> about_center(const BodyRecord& body,
                                           std::shared_ptr<const Motion> X_WM);

}  // namespace dyop::dynamics_internal
