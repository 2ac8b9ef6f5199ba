// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/tolerance.h"
#include "dynamics/overlap.h"
#include "dynamics/step/island_run.h"

namespace dyop::dynamics_internal {
namespace {

// Contacts are sought as far as those of the last substep close in so many steps: impulses of others may
// speed that up. Larger: more contacts that carry nothing; smaller: more hits.
constexpr Scalar kApproaches = 2;
// A reach in use may be so many times what is needed.
constexpr Scalar kMostReach = 4;

// The reach in use if it serves, else the one asked for: changing the reach costs a regeneration.
Scalar steady_reach(Scalar in_use, Scalar base, Scalar way, Scalar most) {
  Scalar wanted = std::min(way, most);
  const Scalar most_in_use = base + kMostReach * std::max(wanted, base);
  if (in_use >= base + wanted && in_use <= most_in_use) return in_use;
  return base + std::min(2 * wanted, most);
}

}  // namespace

// How much nearer the surfaces of a pair in contact may come to each other in a step, as far as its
// contacts tell: bodies that slide along each other get no nearer by it, except where they curve.
Scalar IslandRun::expected_approach(const RunPair& pair, Scalar way) const {
  const PairState& state = *pair.state;
  if (state.overlaps || !(state.has_contacts || pair.is_near)) return kInfinity;
  Scalar closing = context_.h / 2 * pair.acceleration;
  for (const ContactPoint& point : state.points()) {
    closing = std::max(closing, -normal_velocity(*this, pair, point));
  }
  return kApproaches * context_.h * closing + way * way / state.lengths.radius;
}

void IslandRun::find_contacts() {
  const PartTimer timing = timer(&StepTimes::contacts);
  const Scalar h = context_.h;
  const auto way_of = [&](const Twist& twist, const std::optional<std::size_t>& member,
                          const BodyRecord& body) {
    return h * (twist.v_WB.norm() + twist.w_WB.norm() * body.radius +
                (member ? h * context_.gravity_W.norm() : 0));
  };
  for (RunPair& pair : pairs_) {
    PairState& state = *pair.state;
    const PairLengths& lengths = state.lengths;
    const Scalar base = lengths.rest_gap() + kContactReachRestOffsets * lengths.rest_offset;
    const Twist twist_a = central_twist(pair.member_a, *pair.a);
    const Twist twist_b = central_twist(pair.member_b, *pair.b);
    const Scalar way =
        way_of(twist_a, pair.member_a, *pair.a) + way_of(twist_b, pair.member_b, *pair.b);
    const Scalar reach =
        steady_reach(state.reach, base, std::min(way, expected_approach(pair, way)),
                     kContactReachRadiusFraction * lengths.radius);
    pair.is_near = false;
    if (state.gap_lower > reach) continue;
    const RigidPose X_WA = pose_of(pair.member_a, *pair.a);
    const RigidPose X_WB = pose_of(pair.member_b, *pair.b);
    // A distance that begins at the pivot costs less than to find that there are no contacts.
    if (state.gap_lower < 0 || state.overlaps || state.points().empty()) {
      measure_gap(state, *pair.a, X_WA, *pair.b, X_WB, reach);
      if (state.gap_lower > reach) continue;
      if (push_apart(pair, X_WA, X_WB)) continue;
    }
    state.reach = reach;
    const auto shift = [&](const Twist& twist, const BodyRecord& body, const RigidPose& X_W) {
      const Vector3 center = central_pose(body, X_W).translation();
      return Vector3(h * (twist.v_WB - twist.w_WB.cross(center)));
    };
    pair.is_near = refresh_contacts(state, *pair.a, X_WA, *pair.b, X_WB, reach,
                                    shift(twist_b, *pair.b, X_WB) - shift(twist_a, *pair.a, X_WA),
                                    h * (twist_b.w_WB - twist_a.w_WB), workspace_.contacts);
    if (!pair.is_near) measure_gap(state, *pair.a, X_WA, *pair.b, X_WB, reach);
  }
}

// Contacts of a pair that overlaps. Returns whether it does.
bool IslandRun::push_apart(RunPair& pair, const RigidPose& X_WA, const RigidPose& X_WB) {
  PairState& state = *pair.state;
  state.overlaps = !(state.gap_lower > 0);
  state.known_shortest_gap.reset();
  if (!state.overlaps) return false;
  state.overlap_contacts =
      estimate_overlap(*pair.a, X_WA, *pair.b, X_WB, state.lengths.rest_gap(), workspace_.contacts);
  pair.is_near = !state.overlap_contacts.empty();
  return true;
}

}  // namespace dyop::dynamics_internal
