// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_problem.h"
#include "dyop/dynamics/joint.h"

namespace dyop::dynamics_internal {

/// A joint of a World and what is kept from step to step.
struct JointState {
  JointId id;
  JointDefinition definition;
  std::vector<Scalar> impulses;  // one per row: warm start
  /// The angle of a joint that turns about one axis, turns counted: at the World's time, and where
  /// a step in progress is.
  Scalar angle_committed = 0;
  Scalar angle = 0;
  /// Given to B in the step in progress, about the origin of JB, and along the driven coordinate.
  Vector3 impulse_W = Vector3::Zero();
  Vector3 angular_impulse_W = Vector3::Zero();
  Scalar drive_impulse = 0;
  /// In the first half of the last substep, to act again in the second one: on B, and their torques
  /// about the centres of mass. Zero unless the joint is stiff.
  Vector3 half_impulse_W = Vector3::Zero();
  Vector3 half_turn_a_W = Vector3::Zero();
  Vector3 half_turn_b_W = Vector3::Zero();
  Vector3 half_arm_b_W = Vector3::Zero();
  /// Over the last step: mean force, torque, and drive.
  Vector3 force_W = Vector3::Zero();
  Vector3 torque_W = Vector3::Zero();
  Scalar drive = 0;
  /// The two joints of a Coupling, in the World's joints.
  std::array<const JointState*, 2> coupled{};

  bool has_angle() const {
    return definition.kind == JointKind::Hinge || definition.kind == JointKind::Cylindrical;
  }
  /// A step in progress begins.
  void start_from_committed();
  void commit(Scalar h);
};

/// The frames of a joint and the centres of mass of its bodies, world axes.
struct JointPlace {
  RigidPose X_WJa;
  RigidPose X_WJb;
  Vector3 center_a_W;
  Vector3 center_b_W;
  Scalar angle = 0;  // of JB about z of JA, turns counted
};

/// @param expected_angle The angle is the one nearest to it.
JointPlace joint_place(const JointDefinition& joint, const BodyRecord& a, const RigidPose& X_WA,
                       const BodyRecord& b, const RigidPose& X_WB, Scalar expected_angle);

/// The places of a Coupling's two joints; for any other joint its own, first.
using JointPlaces = std::array<JointPlace, 2>;

/// One row of a joint at one pose of its bodies: its error and its Jacobian.
struct JointEquation {
  enum class Kind {
    Equality,
    Limit,
    Motor,  // has a speed as far as its strength allows
    Drive,  // a spring and damper of that strength at most
  };
  Kind kind = Kind::Equality;
  Scalar value = 0;  // length; for a Limit the distance left, >= 0; for a Drive to where it wants
  JointRow row;      // Jacobian and, for a Motor, the speed as target
  // For a Drive.
  Scalar stiffness = 0;
  Scalar damping = 0;
  Scalar speed = 0;
  Scalar scale = 0;  // of the driven coordinate: a length for an angle; 0: another row
  // From the centres of mass to where the joint's force acts: the origin of JB, but of a Distance on
  // A that of JA.
  Vector3 arm_a_W = Vector3::Zero();
  Vector3 arm_b_W = Vector3::Zero();
};

/// The rows at these places, always the same number in the same order. Angles are scaled by
/// `radius`, a length.
std::vector<JointEquation> joint_equations(const JointState& joint, const JointPlaces& places,
                                           Scalar radius);

/// The coordinate of a joint that a Coupling takes as its first or second.
Scalar coupled_coordinate(const JointDefinition& joint, const JointPlace& place, bool is_second);

/// All but what it bears, and the sum of a Coupling; with the twists of the bodies' centres of
/// mass.
JointValues joint_values(const JointDefinition& joint, const JointPlace& place, const Twist& a,
                         const Twist& b);

/// @throws InvalidArgument naming the joint and what is wrong.
void require_valid(const JointDefinition& joint);

/// A spring of a World and what it remembers from step to step.
struct SpringState {
  SpringId id;
  SpringDefinition definition;  // its rest length is known
  /// On B in the first half of the last substep, world axes: what the second half begins with, and
  /// the warm start of the next.
  Vector3 half_impulse_W = Vector3::Zero();

  Scalar rest_length() const { return *definition.rest_length; }
};

/// From P to Q, world axes.
Vector3 spring_vector(const SpringDefinition& spring, const RigidPose& X_WA, const RigidPose& X_WB);

/// Energy stored at this vector.
Scalar spring_energy(const SpringState& spring, const Vector3& p_PQ_W);

/// @throws InvalidArgument naming the spring and what is wrong.
void require_valid(const SpringDefinition& spring);

}  // namespace dyop::dynamics_internal
