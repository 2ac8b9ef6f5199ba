// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dynamics/step/island_run.h"

namespace dyop::dynamics_internal {

/// Steps an island in contact from now() towards the end of the step by the second-order scheme of
/// docs/algorithms/stepping.md:
/// - half a kick of the forces, and a solve for the velocity that moves the bodies, with constant
///   twists;
/// - a proof for every pair; a hit becomes a contact, and the solve is repeated from the same
/// start;
/// - the part that only recovers gaps is removed from the velocity;
/// - the other half of the kick, and a solve at the end.
///
/// Shortens its horizon while it is blocked. Commits to the run.
/// @return Whether time advanced.
bool run_contact_substep(IslandRun& run, bool may_bounce);

/// The end of a substep of length tau, at now(): the other half of the kick, and contacts at the new
/// poses.
void solve_contact_node(IslandRun& run, Scalar tau, bool may_bounce);

}  // namespace dyop::dynamics_internal
