// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/tolerance.h"
#include "dynamics/step/end_gap.h"
#include "dynamics/step/leg_problem.h"

namespace dyop::internal {
namespace {

using RunPair = IslandRun::RunPair;

// How far the linear gap may close over the leg without a dip below what is proven, plus half a
// standoff for the tolerance of the proof.
Scalar most_closing(const RunPair& pair, const LegContact& contact) {
  const PairState& state = *pair.state;
  const Scalar room = contact.point.gap - state.kept_distance() - 0.5 * state.lengths.standoff;
  return closing_at_dip(room, contact.error);
}

}  // namespace

Scalar LegProblem::recovery_cap(std::size_t contact, Scalar tau) const {
  const LegContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const PairLengths& lengths = pair.state->lengths;
  if (pair.state->granted || pair.state->overlaps) {
    return run_.context().options->separation_speed.value_or(kSeparationRadiusFraction *
                                                             lengths.radius / run_.context().h);
  }
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (!member) return Scalar{0};
    const Vector3& w = problem_.bodies[*member].w_W;
    return w.squaredNorm() * body.radius;
  };
  return 0.5 * lengths.standoff / tau + entry.push / tau +
         tau * (turn(pair.member_a, *pair.a) + turn(pair.member_b, *pair.b)) +
         3 * tau * relative_velocity(contact).squaredNorm() / lengths.radius;
}

Scalar LegProblem::least_velocity(std::size_t contact, Scalar tau) const {
  const LegContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const Scalar missing = pair.state->lengths.rest_gap() - entry.point.gap;
  const Scalar rate = missing > 0 ? kGapRecovery * missing : missing;
  const Scalar value = (rate - entry.error + entry.push) / tau;
  if (value <= 0) return std::max(value, -most_closing(pair, entry) / tau);
  return std::min(value, recovery_cap(contact, tau));
}

}  // namespace dyop::internal
