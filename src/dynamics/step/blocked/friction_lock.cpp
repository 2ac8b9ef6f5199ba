// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/blocked/self_stress.h"
#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {
namespace {

// Coefficients of friction, and the places of contacts between bodies that rest a gap apart, are not
// known to a smaller part. Just short of a lock solutions exist, but ask for impulses of thousands of
// times what drives the bodies, until no solver finds them, or no substep is short enough for what they
// do to the bodies.
constexpr Scalar kLockImbalance = 1e-3;

}  // namespace

std::optional<PairKey> SubstepProblem::locked_by_friction() const {
  const auto key_of = [this](std::size_t contact) {
    return run_.pairs()[contacts_[contact].pair].state->key;
  };
  const std::size_t movable = run_.members().size();
  if (const auto stress = find_self_stress(problem_, movable, kLockImbalance)) {
    return key_of(stress->hardest_contact);
  }
  // A substep asks contacts for different ways, as their gaps are not alike. What carries closes its
  // gap: then they move along together, or lock.
  ContactProblem closed = problem_;
  closed.contacts.clear();
  std::vector<std::size_t> carrying;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (problem_.contacts[i].impulse_W.isZero(0)) continue;
    carrying.push_back(i);
    closed.contacts.push_back(problem_.contacts[i]);
    closed.contacts.back().target = 0;
    closed.contacts.back().sticking_velocity_W.setZero();
  }
  const auto stress = find_self_stress(closed, movable, kLockImbalance);
  if (!stress) return std::nullopt;
  return key_of(carrying[stress->hardest_contact]);
}

}  // namespace dyop::dynamics_internal
