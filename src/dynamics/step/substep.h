// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dynamics/step/island.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// How an attempt at a contact substep was blocked.
struct BlockedSubstep {
  Scalar safe = 0;         // time from its start up to which it is proven
  bool must_land = false;  // at a hit to be resolved where it happens
  bool is_infeasible =
      false;  // contacts contradict each other even if bodies may move along together
};

/// The length of the next attempt at a contact substep, after those that were blocked.
class Horizon {
 public:
  explicit Horizon(Scalar remaining) : tau_(remaining) {}

  Scalar tau() const { return tau_; }
  /// Whether the attempt ends at a hit to be resolved there.
  bool lands() const { return lands_; }
  /// Whether shorter substeps stay infeasible: the attempt only uses the room that is left.
  bool only_uses_room() const { return only_uses_room_; }

  void set(Scalar tau) { tau_ = tau; }
  void shorten(const BlockedSubstep& substep);

 private:
  Scalar tau_;
  bool lands_ = false;
  bool was_infeasible_ = false;
  bool only_uses_room_ = false;
};

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
bool run_substep(IslandRun& run, bool may_bounce);

/// The end of a substep of length tau, at now(): the other half of the kick, and contacts at the
/// new poses.
void solve_substep_end(IslandRun& run, Scalar tau, bool may_bounce);

}  // namespace dyop::dynamics_internal
