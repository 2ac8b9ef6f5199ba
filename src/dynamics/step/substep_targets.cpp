// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {
namespace {

using RunPair = IslandRun::RunPair;

// The solve is repeated if a contact would slip by this part of the rest offset because it sticks at
// another place than before. Larger: what spins or pivots gains or loses energy at first order.
constexpr Scalar kStickingChange = 0.001;
// As kErrorChange, where no facet disturbs the gap. Larger: what rolls slowly is lifted or dropped by
// this, at random.
constexpr Scalar kSmoothErrorChange = 0.0001;  // literal: of the rest offset

// How far the linear gap may close over the substep without a dip below what is proven, plus half a
// rest offset for the tolerance of the proof.
Scalar most_closing(const RunPair& pair, const SubstepContact& contact) {
  const PairState& state = *pair.state;
  const Scalar room = contact.point.gap - state.kept_distance() - 0.5 * state.lengths.rest_offset;
  return closing_at_dip(room, contact.error);
}

// An end is found again if the bodies move by this part of what would repeat the solve.
constexpr Scalar kKnownEnd = 0.25;

// In a substep in which an island moves by less than this part of the rest offset, what is left of a gap's
// recovery after a solve would outweigh its own speed.
constexpr Scalar kLeastWay = 0.001;

// Of joints' motors and springs there is no telling what they do to an island at rest: where nothing
// else moves it, its substeps are never short of more than so many steps. More: tolerances below rounding.
constexpr Scalar kMostShortSteps = 100;

// A hit asks more of a contact if it raises its target by this part of the rest offset.
constexpr Scalar kLeastRise = 0.1;

}  // namespace

Scalar SubstepProblem::recovery_cap(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const PairLengths& lengths = pair.state->lengths;
  if (pair.state->granted || pair.state->overlaps) {
    return run_.context().options->separation_speed.value_or(kSeparationRadiusFraction *
                                                             lengths.radius / run_.context().h);
  }
  return 0.5 * lengths.rest_offset / std::max(tau, least_substep()) + entry.push / tau +
         bending_velocity(contact, tau);
}

Scalar SubstepProblem::least_substep() const {
  const Scalar way = kLeastWay * rest_offset_;
  const Scalar by_weight = std::sqrt(2 * way / run_.acceleration());
  const Scalar time = std::min(way / start_speed_, by_weight);
  if (!std::isfinite(time)) return 0;
  if (std::isfinite(by_weight)) return time;
  return std::min(time, kMostShortSteps * run_.context().h);
}

Scalar SubstepProblem::bending_velocity(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const auto turn = [&](const std::optional<std::size_t>& member, const BodyRecord& body) {
    if (!member) return Scalar{0};
    const Vector3& w = problem_.bodies[*member].w_W;
    return w.squaredNorm() * body.radius;
  };
  const Vector3& n = entry.point.nhat_AB_W;
  const Vector3 v_W = relative_velocity(contact);
  const Vector3 sliding_W = v_W - n * n.dot(v_W);
  return tau * (turn(pair.member_a, *pair.a) + turn(pair.member_b, *pair.b)) +
         3 * tau * sliding_W.squaredNorm() / pair.state->lengths.radius +
         relative_turn(contact).norm() * entry.point.merged_way;
}

Scalar SubstepProblem::linear_gap(std::size_t contact, Scalar tau) const {
  const ContactPoint& point = contacts_[contact].point;
  return point.gap + tau * point.nhat_AB_W.dot(relative_velocity(contact));
}

CurvedMove SubstepProblem::curved_move(std::size_t contact, Scalar tau) const {
  const Vector3 turn_W = relative_turn(contact);
  return {linear_gap(contact, tau) + contacts_[contact].error,
          tau * relative_velocity(contact).norm(), tau * turn_W.norm(),
          tau * turn_W.cross(contacts_[contact].point.nhat_AB_W).norm()};
}

// With the velocities of the last solve, the bodies' points in the middle of the contact's way have
// this velocity less than those at its start.
Scalar SubstepProblem::stick_midway(std::size_t contact, const Vector3& p_W_end, Scalar tau) {
  PointContact& row = problem_.contacts[contact];
  const ContactPoint& point = contacts_[contact].point;
  const Vector3 way = (p_W_end - (point.p_WCa + point.p_WCb) / 2) / 2;
  const auto change = [&](const ContactBody& body) -> Vector3 {
    return body.w_W.cross(way - tau / 2 * body.v_W);
  };
  Vector3 velocity_W = change(problem_.bodies[row.body_a]) - change(problem_.bodies[row.body_b]);
  velocity_W -= row.nhat_AB_W * row.nhat_AB_W.dot(velocity_W);
  std::swap(row.sticking_velocity_W, velocity_W);
  return row.friction > 0 ? (row.sticking_velocity_W - velocity_W).norm() : 0;
}

bool SubstepProblem::end_is_known(std::size_t contact, Scalar tau) const {
  if (contact >= ends_.size()) return false;
  const TakenEnd& end = ends_[contact];
  const IslandRun::RunPair& pair = run_.pairs()[contacts_[contact].pair];
  const PointContact& row = problem_.contacts[contact];
  const ContactBody& a = problem_.bodies[row.body_a];
  const ContactBody& b = problem_.bodies[row.body_b];
  const Scalar change = (a.v_W - end.v_a_W).norm() + (a.w_W - end.w_a_W).norm() * pair.a->radius +
                        (b.v_W - end.v_b_W).norm() + (b.w_W - end.w_b_W).norm() * pair.b->radius;
  return tau * change <= end.tolerance;
}

bool SubstepProblem::ends_short(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  return linear_gap(contact, tau) + entry.error < run_.pairs()[entry.pair].state->kept_distance();
}

bool SubstepProblem::take_end(std::size_t contact, const EndGap& end, Scalar tau) {
  SubstepContact& entry = contacts_[contact];
  const PairLengths& lengths = run_.pairs()[entry.pair].state->lengths;
  const Scalar error = end.gap - linear_gap(contact, tau);
  const Scalar change = std::abs(error - entry.error);
  entry.error = error;
  const Scalar slip = end.p_W ? tau * stick_midway(contact, *end.p_W, tau) : 0;
  const Scalar most_change = end.is_smooth ? kSmoothErrorChange : kErrorChange;
  const PointContact& row = problem_.contacts[contact];
  const ContactBody& a = problem_.bodies[row.body_a];
  const ContactBody& b = problem_.bodies[row.body_b];
  ends_.resize(contacts_.size());
  ends_[contact] = {a.v_W, a.w_W, b.v_W, b.w_W, kKnownEnd * most_change * lengths.rest_offset};
  const bool carries = !problem_.contacts[contact].impulse_W.isZero(0);
  if (!carries && end.gap >= lengths.rest_gap() + lengths.rest_offset) return false;
  return change > most_change * lengths.rest_offset || slip > kStickingChange * lengths.rest_offset;
}

Scalar SubstepProblem::least_velocity(std::size_t contact, Scalar tau) const {
  const SubstepContact& entry = contacts_[contact];
  const RunPair& pair = run_.pairs()[entry.pair];
  const Scalar missing = pair.state->lengths.rest_gap() - entry.point.gap;
  const Scalar rate = missing > 0 ? kGapRecovery * missing : missing;
  const Scalar value = (rate - entry.error + entry.push) / tau;
  if (value <= 0) return std::max(value, -most_closing(pair, entry) / tau);
  return std::min(value, recovery_cap(contact, tau));
}

void SubstepProblem::set_targets(Scalar tau, bool recovers) {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    set_target(i, target_of_substep(i, tau, recovers));
  }
}

bool SubstepProblem::asks_more(std::size_t known, Scalar tau, bool recovers) const {
  if (contacts_.size() > known) return true;
  const Scalar noise = kLeastRise * rest_offset_ / tau;
  for (std::size_t i = 0; i < known; ++i) {
    if (target_of_substep(i, tau, recovers) > problem_.contacts[i].target + noise) return true;
  }
  return false;
}

Scalar SubstepProblem::target_of_substep(std::size_t contact, Scalar tau, bool recovers) const {
  const Scalar value = least_velocity(contact, tau);
  return recovers ? value : std::min(value, Scalar{0});
}

}  // namespace dyop::dynamics_internal
