// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/motion/steady_motions.h"

// An island falls asleep when it is slow and impulses at its contacts are found that balance
// gravity, or when it has been slow for long. It wakes when forces change, when what its bodies lie
// on moves or goes away, or when something awake comes within reach.
namespace dyop {
namespace {

// Slow steps of an island before a balance is looked for: in a single one it may be at a turning
// point. And between two searches, as one that fails costs as much as a step.
constexpr int kBalanceSteps = 2;
constexpr int kStepsBetweenBalances = 10;
// A balance leaves this part of what gravity gives in a step to a contact, and to a body. Larger:
// what begins to slide or to lean slowly is put to sleep; smaller: rounding of redundant contacts.
constexpr Scalar kBalance = 1e-6;       // literal: a ratio of velocities
constexpr Scalar kBalanceSpeed = 1e-5;  // literal: a ratio of velocities
constexpr int kBalanceFactorisations = 25;

}  // namespace

using dynamics_internal::BodyRecord;
using dynamics_internal::Island;
using dynamics_internal::IslandOutcome;
using dynamics_internal::JointState;
using dynamics_internal::PairKey;
using dynamics_internal::PairState;
using dynamics_internal::SpringState;

// Wakes a body and all sleepers that it touches, directly or through others.
void World::Impl::wake(std::uint32_t slot, AdvanceReport* report) {
  std::vector<std::uint32_t> open{slot};
  while (!open.empty()) {
    const std::uint32_t next = open.back();
    open.pop_back();
    BodyRecord& body = bodies[next];
    body.slow_steps = 0;
    if (!body.is_asleep) continue;
    body.is_asleep = false;
    if (report) report->woke.push_back(body.id);
    for (const auto& pair : pairs) {
      if (!pair->has_contacts) continue;
      if (pair->key.a == next && bodies[pair->key.b].is_asleep) open.push_back(pair->key.b);
      if (pair->key.b == next && bodies[pair->key.a].is_asleep) open.push_back(pair->key.a);
    }
    for (const auto& [a, b] : links) {
      if (a == next && bodies[b].is_asleep) open.push_back(b);
      if (b == next && bodies[a].is_asleep) open.push_back(a);
    }
  }
}

void World::Impl::wake_what_changed(const TimeInterval& interval, AdvanceReport& report) {
  for (std::uint32_t slot = 0; slot < bodies.size(); ++slot) {
    const BodyRecord& body = bodies[slot];
    if (!body.is_present() || !body.is_asleep || !body.definition.wrench) continue;
    const Wrench now = total_wrench(body, gravity_W, time, body.motion_state());
    const Wrench& then = body.wrench_asleep;
    const Scalar change =
        (now.force - then.force).norm() * body.radius + (now.torque - then.torque).norm();
    const Scalar size = then.force.norm() * body.radius + then.torque.norm();
    if (change > kWakeWrenchChange * size) wake(slot, &report);
  }
  const bool has_moving = std::any_of(bodies.begin(), bodies.end(), [&](const BodyRecord& body) {
    return moves_by_itself(body, interval);
  });
  if (!has_moving) return;
  for (const PairKey& link : links) {
    const BodyRecord& a = bodies[link.a];
    const BodyRecord& b = bodies[link.b];
    if (a.is_asleep && moves_by_itself(b, interval)) wake(a.id.slot, &report);
    if (b.is_asleep && moves_by_itself(a, interval)) wake(b.id.slot, &report);
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const PairKey key = pairs[i]->key;
    if (!pairs[i]->has_contacts) continue;
    if (bodies[key.a].is_asleep && moves_by_itself(bodies[key.b], interval)) wake(key.a, &report);
    if (bodies[key.b].is_asleep && moves_by_itself(bodies[key.a], interval)) wake(key.b, &report);
  }
}

// What an island lies on or hangs on stays where it is, and no pair of it has yet to be pushed
// apart.
bool World::Impl::is_held(const Island& island, Scalar h) const {
  bool touches = !island.joints.empty() || !island.springs.empty();
  for (const PairState* pair : island.pairs) {
    if (!pair->has_contacts) continue;
    touches = true;
    if (pair->uncertified_gap || pair->overlaps) return false;
    for (const std::uint32_t slot : {pair->key.a, pair->key.b}) {
      const BodyRecord& body = bodies[slot];
      if (body.definition.kind != BodyKind::Kinematic) continue;
      const TimeInterval domain = body.definition.motion->domain();
      if (moves_by_itself(body, {time, std::min(time + h, domain.end)})) return false;
    }
  }
  const auto is_carried = [&](BodyId a, BodyId b) {
    const TimeInterval step{time - h, time};
    return moves_by_itself(bodies[a.slot], step) || moves_by_itself(bodies[b.slot], step);
  };
  for (const JointState* joint : island.joints) {
    const JointDefinition& definition = joint->definition;
    if (definition.motor && definition.motor->speed != 0) return false;
    if (is_carried(definition.a, definition.b)) return false;
  }
  for (const SpringState* spring : island.springs) {
    if (is_carried(spring->definition.a, spring->definition.b)) return false;
  }
  return touches;
}

World::Impl::SleepLimit World::Impl::sleep_limit(const Island& island, Scalar h) const {
  Scalar rest_offset = kInfinity;
  for (const PairState* pair : island.pairs) {
    rest_offset = std::min(rest_offset, pair->lengths.rest_offset);
  }
  const auto count_body = [&](BodyId id) {
    const Scalar usual = kRestOffsetTargets * kTargetRadiusFraction * bodies[id.slot].radius;
    rest_offset = std::min(rest_offset, usual);
  };
  for (const JointState* joint : island.joints) {
    count_body(joint->definition.a);
    count_body(joint->definition.b);
  }
  for (const SpringState* spring : island.springs) {
    count_body(spring->definition.a);
    count_body(spring->definition.b);
  }
  const Scalar travel = kSleepRestOffsetFraction * rest_offset;
  // In a shorter time everything moves by less than `way`, even what falls.
  const Scalar fall = gravity_W.isZero(0) ? 0 : std::sqrt(2 * travel / gravity_W.norm());
  const Scalar span = options.sleep_speed ? h : std::max(h, fall);
  return {options.sleep_speed.value_or(travel / span), options.sleep_steps * (span / h)};
}

void World::Impl::fall_asleep(BodyRecord& body) {
  body.is_asleep = true;
  body.state.v_W.setZero();
  body.state.L_W.setZero();
  body.flight = nullptr;
  body.rest = std::make_shared<RestMotion>(body.X_WB());
  if (body.definition.wrench) {
    body.wrench_asleep = total_wrench(body, gravity_W, time, body.motion_state());
  }
}

void World::Impl::put_to_sleep(const std::vector<Island>& islands,
                               const std::vector<IslandOutcome>& outcomes, Scalar h,
                               AdvanceReport& report) {
  if (options.sleep_steps <= 0) return;
  for (std::size_t i = 0; i < islands.size(); ++i) {
    const bool may_sleep = outcomes[i].in_contact && is_held(islands[i], h);
    const SleepLimit limit = sleep_limit(islands[i], h);
    int slow_steps = std::numeric_limits<int>::max();  // of all bodies
    for (const std::uint32_t slot : islands[i].bodies) {
      BodyRecord& body = bodies[slot];
      const Scalar speed = body.state.v_W.norm() + body.angular_velocity().norm() * body.radius;
      body.slow_steps = may_sleep && speed < limit.speed ? body.slow_steps + 1 : 0;
      slow_steps = std::min(slow_steps, body.slow_steps);
    }
    if (!may_sleep || slow_steps == 0) continue;
    const bool is_due =
        slow_steps >= kBalanceSteps && (slow_steps - kBalanceSteps) % kStepsBetweenBalances == 0;
    if (!(slow_steps >= limit.steps || (is_due && is_balanced(islands[i], h)))) continue;
    if (options.records_impulses) {
      VelocityChange& change = report.velocity_changes.emplace_back();
      change.kind = VelocityChangeKind::Sleep;
      change.interval = {time, time};
      for (const std::uint32_t slot : islands[i].bodies) {
        MomentumChange& body = change.bodies.emplace_back();
        body.body = bodies[slot].id;
        body.v_before_W = bodies[slot].state.v_W;
        body.L_before_W = bodies[slot].state.L_W;
      }
    }
    for (const std::uint32_t slot : islands[i].bodies) {
      fall_asleep(bodies[slot]);
      report.fell_asleep.push_back(bodies[slot].id);
    }
  }
}

// A static certificate: impulses at the contacts, within their friction cones, that take from every
// body what gravity gives it in the step. Then nothing begins to move. Only of islands of contacts
// under gravity whose gaps no longer recover; what else acts on a body may change.
bool World::Impl::is_balanced(const Island& island, Scalar h) {
  const Scalar kick = h * gravity_W.norm();
  if (!(kick > 0) || !island.joints.empty() || !island.springs.empty()) return false;
  if (options.friction_law) return false;
  ContactProblem problem;
  for (const std::uint32_t slot : island.bodies) {
    const BodyRecord& body = bodies[slot];
    if (body.definition.wrench) return false;
    ContactBody& member = problem.bodies.emplace_back();
    member.inverse_mass_W = body.linear_mobility();
    member.inverse_inertia_W = body.angular_mobility(body.state.X_WM.rotation());
    member.free_v_W =
        h * body.definition.mass_properties.mass * (member.inverse_mass_W * gravity_W);
  }
  if (!add_static_contacts(island, h, problem)) return false;
  ContactSolverOptions solver = options.solver;
  solver.tolerance = kBalance * kick;
  // Interior points, which need no sweeps; for one or two bodies Newton's method.
  const bool is_small = island.bodies.size() <= kContactFewBodies;
  solver.newton_limit = kBalanceFactorisations;
  solver.cascade_rounds = is_small ? 1 : 0;
  solver.admm_limit = 0;
  solver.restart_contacts = 0;
  const ContactReport found = workspaces.front()->solver.solve(problem, solver);
  if (found.status != ContactStatus::Converged || found.immovable_violations > 0) return false;
  for (std::size_t i = 0; i < island.bodies.size(); ++i) {
    const ContactBody& member = problem.bodies[i];
    const Scalar speed = member.v_W.norm() + member.w_W.norm() * bodies[island.bodies[i]].radius;
    if (!(speed <= kBalanceSpeed * kick)) return false;
  }
  return true;
}

// The contacts of an island at rest. Those that do not touch may close. Returns false if one is
// still being pushed to its rest gap.
bool World::Impl::add_static_contacts(const Island& island, Scalar h,
                                      ContactProblem& problem) const {
  std::map<std::uint32_t, std::size_t> index_of;
  for (const std::uint32_t slot : island.bodies) index_of.emplace(slot, index_of.size());
  const auto index = [&](std::uint32_t slot) {
    const auto [found, is_new] = index_of.try_emplace(slot, problem.bodies.size());
    if (is_new) problem.bodies.emplace_back();
    return found->second;
  };
  for (const PairState* pair : island.pairs) {
    if (!pair->has_contacts) continue;
    const BodyRecord& a = bodies[pair->key.a];
    const BodyRecord& b = bodies[pair->key.b];
    const auto points = pair->points();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const ContactPoint& point = points[k];
      PointContact contact;
      contact.body_a = index(pair->key.a);
      contact.body_b = index(pair->key.b);
      const Vector3 middle = (point.p_WCa + point.p_WCb) / 2;
      contact.r_a_W = middle - a.state.X_WM.translation();
      contact.r_b_W = middle - b.state.X_WM.translation();
      contact.nhat_AB_W = point.nhat_AB_W;
      contact.friction = pair->material.friction;
      contact.rolling_friction = pair->material.rolling_friction;
      contact.torsional_friction = pair->material.torsional_friction;
      const Scalar above = point.gap - pair->lengths.rest_gap();
      if (above < -pair->lengths.tolerance()) return false;
      if (above > pair->lengths.rest_offset / 2) contact.target = -above / h;
      if (k < pair->impulses.size()) contact.impulse_W = pair->impulses[k];
      problem.contacts.push_back(contact);
    }
  }
  return true;
}

}  // namespace dyop
