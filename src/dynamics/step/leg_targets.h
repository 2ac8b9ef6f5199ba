// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dynamics/step/leg_problem.h"

namespace dyop::internal {

/// Least normal velocity of a contact in a leg of length tau, length per time: keeps the rest gap
/// until the end or recovers a part of it, at bounded speed, and keeps a corner that turns away
/// from dipping on the way. Uses the error of the last prediction and the velocities of the last
/// solve.
Scalar leg_target(IslandRun& run, const LegProblem& leg, std::size_t contact, Scalar tau);

}  // namespace dyop::internal
