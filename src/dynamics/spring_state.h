// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dynamics/body_record.h"
#include "dyop/dynamics/spring.h"

namespace dyop::dynamics_internal {

/// A spring of a World and what it remembers from step to step.
struct SpringState {
  SpringId id;
  SpringDefinition definition;  // its rest length is known
  /// On B in the first half of the last substep, world axes: what the second half begins with, and the
  /// warm start of the next.
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
