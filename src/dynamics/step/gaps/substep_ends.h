// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {

/// Of a pair, before and after a substep.
struct PairPoses {
  RigidPose X_WA, X_WB;
  RigidPose X_WA_end, X_WB_end;
};

/// Where these contacts of a substep of length tau are at its end, after the last solve, in their order.
/// @param poses By pair.
/// @return None if the search was cut off; see measured_end_gaps().
std::optional<std::vector<EndGap>> find_ends(SubstepProblem& substep, Scalar tau,
                                             std::span<const PairPoses> poses,
                                             std::span<const std::size_t> contacts);

}  // namespace dyop::dynamics_internal
