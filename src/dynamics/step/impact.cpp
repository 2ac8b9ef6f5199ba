// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dynamics/step/island.h"
#include "dynamics/step/link_rows.h"
#include "dynamics/step/substep_problem.h"

namespace dyop::dynamics_internal {
namespace {

using RunPair = IslandRun::RunPair;

Vector3 point_velocity(const IslandRun& run, const std::optional<std::size_t>& member,
                       const BodyRecord& body, const Vector3& p_W) {
  const Twist twist = run.central_twist(member, body);
  const Vector3 center = central_pose(body, run.pose_of(member, body)).translation();
  return twist.v_WB + twist.w_WB.cross(p_W - center);
}

// The list of points also has places that may meet later in the step; an impulse now would act
// across their gap.
bool is_met(const RunPair& pair, const ContactPoint& point) {
  const PairLengths& lengths = pair.state->lengths;
  return point.gap <= lengths.rest_gap() + 0.5 * lengths.rest_offset;
}

bool has_met(const RunPair& pair) {
  const auto points = pair.state->points();
  return pair.is_near && std::any_of(points.begin(), points.end(), [&](const ContactPoint& point) {
           return is_met(pair, point);
         });
}

bool is_triggered(const IslandRun& run, const RunPair& pair, const ContactPoint& point) {
  if (!is_met(pair, point)) return false;
  if (pair.hit) return normal_velocity(run, pair, point) < -run.restitution_speed(pair);
  return pair.restitution > 0 && point.gap <= pair.state->lengths.rest_gap() &&
         bounces(run, pair, normal_velocity(run, pair, point));
}

std::optional<std::int32_t> child_of(const BodyRecord& body, const FeatureKey& key) {
  if (body.definition.shape->kind() != ShapeKind::Compound) return std::nullopt;
  return key.piece;
}

WorldContact world_contact(const RunPair& pair, const ContactPoint& point, Scalar speed,
                           const Vector3& impulse_W) {
  WorldContact result;
  result.a = pair.a->id;
  result.b = pair.b->id;
  result.contact = {point.lower,
                    point.upper,
                    point.p_WCa,
                    point.p_WCb,
                    point.nhat_AB_W,
                    point.feature_a,
                    point.feature_b,
                    point.triangle_a,
                    point.triangle_b,
                    child_of(*pair.a, point.key.a),
                    child_of(*pair.b, point.key.b)};
  result.normal_velocity = speed;
  result.impulse_W = impulse_W;
  return result;
}

// Limit of rounds at one time; a row of so many balls passes a push on.
constexpr int kMostImpactRounds = 100;

// After so many rounds without a solution a body has no way out, and more impulses would only be
// noise.
constexpr int kMostUnsolvedRounds = 2;

// The impact law at one time, one round of it: every contact that closes fast leaves with its
// restitution. Contacts that would bounce but do not close have no part in the round, so that a
// push is passed on through a row of touching bodies one after the other ([Smith2012]); those
// without restitution support at once.
class ImpactSolve {
 public:
  ImpactSolve(IslandRun& run, bool takes_all);
  // Whether a contact bounces.
  bool has_work() const;
  // Whether the law has been solved; the bodies get the velocities of the last try anyway.
  bool solve();
  void write(ImpactEvent& event) const;

 private:
  bool solve_with(Scalar bounce);
  bool solve_without_gain();

  IslandRun& run_;
  SubstepProblem substep_;
  std::vector<Scalar> speeds_;       // normal velocities before the impact
  std::vector<Scalar> restitution_;  // zero for slow contacts
  std::vector<Vector3> free_L_W_;
};

ImpactSolve::ImpactSolve(IslandRun& run, bool takes_all) : run_(run), substep_(run) {
  substep_.take_contacts([&](const RunPair& pair, const ContactPoint& point) {
    if (is_triggered(run, pair, point)) return true;
    if (!is_met(pair, point)) return false;
    return takes_all || !(pair.restitution > 0) ||
           bounces(run, pair, normal_velocity(run, pair, point));
  });
  for (std::size_t i = 0; i < run.members().size(); ++i) {
    const IslandRun::Member& member = run.members()[i];
    ContactBody& body = substep_.problem().bodies[i];
    body.free_v_W = member.state.v_W;
    body.free_w_W = body.inverse_inertia_W * member.state.L_W;
    free_L_W_.push_back(member.state.L_W);
  }
  substep_.take_joints(0);  // motors give no impulse at an instant
  substep_.set_supports(0);
  for (std::size_t i = 0; i < substep_.rows().size(); ++i) {
    const JointEquation::Kind kind = substep_.rows()[i].equation.kind;
    const Scalar left = substep_.rows()[i].equation.value;
    if (kind == JointEquation::Kind::Equality) substep_.set_row_target(i, 0);
    if (kind == JointEquation::Kind::Limit) {
      substep_.set_row_target(i, std::min(0.0, -left / run.context().h));
    }
  }
  for (std::size_t i = 0; i < substep_.contacts().size(); ++i) {
    const SubstepContact& entry = substep_.contacts()[i];
    const RunPair& pair = run.pairs()[entry.pair];
    speeds_.push_back(normal_velocity(run, pair, entry.point));
    restitution_.push_back(bounces(run, pair, speeds_.back()) ? pair.restitution : 0);
    substep_.problem().contacts[i].impulse_W.setZero();
  }
}

bool ImpactSolve::has_work() const {
  return std::any_of(restitution_.begin(), restitution_.end(), [](Scalar e) { return e > 0; });
}

bool ImpactSolve::solve_with(Scalar bounce) {
  for (std::size_t i = 0; i < speeds_.size(); ++i) {
    substep_.set_target(i, -bounce * restitution_[i] * std::min(speeds_[i], 0.0));
  }
  return substep_.solve(run_.context().h, true).status == ContactStatus::Converged;
}

// Newton's restitution with friction can create energy ([Kane1984]). Then the largest part of it
// that does not, by bisection; without any bounce no energy is gained. Kinematic bodies may do work:
// only what is done between bodies counts.
bool ImpactSolve::solve_without_gain() {
  const bool is_solved = solve_with(1);
  const Scalar h = run_.context().h;
  if (!has_work() || !substep_.has_gained_energy(h)) return is_solved;
  Scalar most = 0;
  Scalar too_much = 1;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const Scalar middle = (most + too_much) / 2;
    solve_with(middle);
    (substep_.has_gained_energy(h) ? too_much : most) = middle;
  }
  return solve_with(most);
}

bool ImpactSolve::solve() {
  VelocityChange* change = run_.begin_change(VelocityChangeKind::Impact, {run_.now(), run_.now()});
  const bool is_solved = solve_without_gain();
  add_reactions(substep_);
  const std::vector<Vector3> L_W = substep_.angular_momenta(free_L_W_);
  for (std::size_t i = 0; i < run_.members().size(); ++i) {
    run_.members()[i].state.v_W = substep_.problem().bodies[i].v_W;
    run_.members()[i].state.L_W = L_W[i];
    run_.members()[i].flight = nullptr;
  }
  if (change != nullptr) substep_.add_impulses(*change);
  run_.end_change(change);
  return is_solved;
}

// A contact of several rounds is told once, with the sum of its impulses.
void ImpactSolve::write(ImpactEvent& event) const {
  for (std::size_t i = 0; i < substep_.contacts().size(); ++i) {
    const SubstepContact& entry = substep_.contacts()[i];
    const RunPair& pair = run_.pairs()[entry.pair];
    const Vector3& impulse = substep_.problem().contacts[i].impulse_W;
    const auto known = std::find_if(event.contacts.begin(), event.contacts.end(),
                                    [&](const WorldContact& contact) {
                                      return contact.a == pair.a->id && contact.b == pair.b->id &&
                                             contact.contact.p_WCa == entry.point.p_WCa &&
                                             contact.contact.p_WCb == entry.point.p_WCb;
                                    });
    if (known != event.contacts.end()) {
      known->impulse_W += impulse;
    } else {
      event.contacts.push_back(world_contact(pair, entry.point, speeds_[i], impulse));
    }
  }
}

}  // namespace

Scalar normal_velocity(const IslandRun& run, const RunPair& pair, const ContactPoint& point) {
  const Vector3 middle = (point.p_WCa + point.p_WCb) / 2;
  return point.nhat_AB_W.dot(point_velocity(run, pair.member_b, *pair.b, middle) -
                             point_velocity(run, pair.member_a, *pair.a, middle));
}

bool bounces(const IslandRun& run, const RunPair& pair, Scalar normal_velocity) {
  // What a callback left as it is does not bounce any more.
  if (!(pair.restitution > 0) || pair.state->answered_at == run.now()) return false;
  const Scalar least = pair.hit ? run.restitution_speed(pair) : run.contact_restitution_speed(pair);
  return normal_velocity < -least;
}

bool resolve_impacts(IslandRun& run, bool may_bounce) {
  const RunPair* met = nullptr;
  for (RunPair& pair : run.pairs()) {
    if (!may_bounce || !pair.is_near) continue;
    for (const ContactPoint& point : pair.state->points()) {
      if (!is_triggered(run, pair, point)) continue;
      if (!met || (pair.hit && !met->hit)) met = &pair;
    }
  }
  const auto forget = [&] {
    for (RunPair& pair : run.pairs()) pair.hit.reset();
  };
  if (!met) {
    for (RunPair& pair : run.pairs()) {
      if (pair.hit && !has_met(pair)) ++pair.missed_landings;
    }
    forget();
    return false;
  }
  // A pair that has met may miss its next landing as often again.
  for (RunPair& pair : run.pairs()) {
    if (pair.hit && has_met(pair)) pair.missed_landings = 0;
  }
  ImpactEvent& event = run.outcome().impacts.emplace_back();
  event.t = run.now();
  event.a = met->a->id;
  event.b = met->b->id;
  if (met->hit) event.toi = *met->hit;
  if (run.context().options->policy != ImpactPolicy::Impulse) {
    run.outcome().stopped_at_impact = true;
    ImpactSolve(run, true).write(event);
    forget();
    return true;
  }
  int unsolved = 0;
  for (int round = 1; round <= kMostImpactRounds && unsolved < kMostUnsolvedRounds; ++round) {
    ImpactSolve solve(run, round == kMostImpactRounds);
    if (round > 1 && !solve.has_work()) break;
    unsolved += solve.solve() ? 0 : 1;
    solve.write(event);
    forget();
  }
  return true;
}

}  // namespace dyop::dynamics_internal
