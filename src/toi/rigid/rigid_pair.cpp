// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/rigid_pair.h"

#include <algorithm>

#include "distance/point_search.h"
#include "dyop/distance/distance.h"

namespace dyop::toi_internal {

RigidPair::RigidPair(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                     const TimeInterval& interval, const ImpactBand& band,
                     std::span<const BoxPair> first_pairs)
    : kernels_(box_steps_kernels(best_instruction_set())),
      moving_(a, X_WA, b, X_WB, interval, band.box_target),
      first_target_(is_single_leaf_pair() ? band.leaf_target : band.box_target),
      first_pairs_(first_pairs) {}

Scalar RigidPair::start_noise() const {
  const auto [X_WA, X_WB] = poses(time());
  return pose_noise(a().shape, X_WA, b().shape, X_WB);
}

// Lengthens the steps of boxes that last as long as the outlook.
void RigidPair::step_further(BoxStepsKernel kernel, const GroupRows& rows, int first, int count,
                             const FacingPiece& other, bool from_a, BoxSteps& steps) {
  for (std::size_t k = 0;;) {
    const PairInstant& outlook = moving_.outlook(k);
    Scalar shortest = kInfinity;
    for (int i = first; i < first + count; ++i) {
      const bool may_go_on = steps.time[i] >= outlook.horizon && steps.time[i] < outlook.remaining;
      if (may_go_on) shortest = std::min(shortest, steps.time[i]);
    }
    if (shortest == kInfinity) return;
    k = moving_.outlook_beyond(k, shortest);
    if (k == 0) return;
    BoxSteps further;
    kernel(rows, first, count, other, moving_.facing_motion(from_a, k), &further);
    steps.is_far |= further.is_far;
    for (int i = first; i < first + count; ++i) {
      steps.time[i] = std::max(steps.time[i], further.time[i]);
    }
  }
}

Scalar RigidPair::step_of_balls() {
  return moving_.longest_step([&](const PairInstant& outlook) {
    return safe_time_of_balls(outlook, a().radius, b().radius, first_target_);
  });
}

// Only balls about the origins survive turns: while their steps span more than a turn, they lead
// the search.
Scalar RigidPair::skip_turns() {
  constexpr int kSteps = 32;
  constexpr Scalar kTurn = 6.3;
  const PairInstant& now = moving_.now();
  const Scalar turning = std::max(now.angular_speed_a, now.angular_speed_b);
  for (int k = 0; k < kSteps; ++k) {
    const Scalar step = step_of_balls();
    if (!(step * turning > kTurn)) break;
    if (step >= now.remaining) return kInfinity;
    if (!(time() + step > time())) break;
    set_time(time() + step);
  }
  return time();
}

// Two convex shapes need no measuring while balls about their origins are proven apart.
Scalar RigidPair::first_time() {
  const Scalar begin = skip_turns();
  if (begin == kInfinity || !is_single_leaf_pair()) return begin;
  const Scalar step = step_of_balls();
  return step > 0 && step >= moving_.now().remaining ? kInfinity : begin + step;
}

std::optional<Vector3> RigidPair::enclosed_point(const ToiOptions& options) const {
  if (!options.solid_a && !options.solid_b) return std::nullopt;
  const auto [X_WA, X_WB] = poses(time());
  return find_enclosed_point(a().shape, X_WA, b().shape, X_WB, {options.solid_a, options.solid_b});
}

std::pair<RigidPose, RigidPose> RigidPair::poses(Scalar t) const {
  if (t == time()) return {pose_of(moving_.now().a), pose_of(moving_.now().b)};
  return {guarded_pose(a().motion, t, a().name), guarded_pose(b().motion, t, b().name)};
}

Scalar RigidPair::witness_distance(const ToiResult& impact) const {
  const auto [X_WA, X_WB] = poses(time());
  const Vector3 p_WCa = X_WA * (impact.X_WA.inverse() * impact.contact->p_WCa);
  const Vector3 p_WCb = X_WB * (impact.X_WB.inverse() * impact.contact->p_WCb);
  return (p_WCb - p_WCa).norm() + noise();
}

std::vector<Contact> RigidPair::contacts_within(Scalar reach) const {
  const auto [X_WA, X_WB] = poses(time());
  return find_contacts(a().shape, X_WA, b().shape, X_WB, reach);
}

}  // namespace dyop::toi_internal
