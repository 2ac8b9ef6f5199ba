// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_problem.h"
#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/spring.h"

namespace dyop::dynamics_internal {

/// A joint of a World and what is kept from step to step.
struct JointState {
  JointId id;
  JointDefinition definition;
  std::vector<Scalar> impulses;  // one per row: warm start
};

/// One row of a joint at one pose of its bodies: its error and its Jacobian.
struct JointEquation {
  enum class Kind { Equality, Limit, Motor };
  Kind kind = Kind::Equality;
  Scalar value = 0;  // length; for a Limit the distance left, >= 0; for a Motor 0
  JointRow row;      // Jacobian and, for a Motor, the speed as target
};

/// The rows at these poses of the bodies' frames, always the same number in the same order. Angles
/// are scaled by `radius`, a length.
std::vector<JointEquation> joint_equations(const JointDefinition& joint, const BodyRecord& a,
                                           const RigidPose& X_WA, const BodyRecord& b,
                                           const RigidPose& X_WB, Scalar radius);

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
