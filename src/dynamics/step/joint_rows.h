// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {

/// Targets of the joints' rows for a move of length tau: they close the joint's errors, no faster
/// than bodies that began too near are pushed apart, and undo all that the substep itself would add.
void set_joint_targets(SubstepProblem& substep, Scalar tau);

/// Pose of the frame B of a body at the end of the move.
using EndPose =
    std::function<RigidPose(const std::optional<std::size_t>& member, const BodyRecord& body)>;

/// Compares the joints at the end with their linear prediction. Returns whether it has changed so
/// much that the solve must be repeated.
bool update_joint_errors(SubstepProblem& substep, Scalar tau, const EndPose& end_pose);

/// Whether the prediction of a joint's end still changes much: the bodies turn too far in a substep of
/// length tau to be held, and a shorter one is needed.
bool joints_are_guessed(const SubstepProblem& substep, Scalar tau);

/// Removes from the targets what only recovers errors of position. Returns whether there was any.
bool release_joint_recovery(SubstepProblem& substep, Scalar tau);

}  // namespace dyop::dynamics_internal
