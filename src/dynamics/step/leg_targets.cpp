// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/leg_targets.h"

#include <algorithm>

#include "core/tolerance.h"
#include "dynamics/step/end_gap.h"

namespace dyop::internal {
namespace {

using RunPair = IslandRun::RunPair;

// Largest target that recovers a gap.
Scalar target_cap(IslandRun& run, const LegProblem& leg, std::size_t contact, Scalar tau) {
  const LegContact& entry = leg.contacts()[contact];
  const RunPair& pair = run.pairs()[entry.pair];
  const PairLengths& lengths = pair.state->lengths;
  if (pair.state->granted || pair.state->overlaps) {
    return run.context().options->separation_speed.value_or(kSeparationRadiusFraction *
                                                            lengths.radius / run.context().h);
  }
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (!member) return Scalar{0};
    const Vector3& w = leg.problem().bodies[*member].w_W;
    return w.squaredNorm() * body.radius;
  };
  return 0.5 * lengths.standoff / tau + entry.push / tau +
         tau * (turn(pair.member_a, *pair.a) + turn(pair.member_b, *pair.b)) +
         3 * tau * leg.relative_velocity(contact).squaredNorm() / lengths.radius;
}

// How far the linear gap may close over the leg without a dip below what is proven, plus half a
// standoff for the tolerance of the proof.
Scalar most_closing(const RunPair& pair, const LegContact& contact) {
  const PairState& state = *pair.state;
  const Scalar room = contact.point.gap - state.kept_distance() - 0.5 * state.lengths.standoff;
  return closing_at_dip(room, contact.error);
}

}  // namespace

Scalar leg_target(IslandRun& run, const LegProblem& leg, std::size_t contact, Scalar tau) {
  const LegContact& entry = leg.contacts()[contact];
  const RunPair& pair = run.pairs()[entry.pair];
  const Scalar missing = pair.state->lengths.rest_gap() - entry.point.gap;
  const Scalar rate = missing > 0 ? kGapRecovery * missing : missing;
  const Scalar value = (rate - entry.error + entry.push) / tau;
  if (value <= 0) return std::max(value, -most_closing(pair, entry) / tau);
  return std::min(value, target_cap(run, leg, contact, tau));
}

}  // namespace dyop::internal
