// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/world_impl.h"
#include "dyop/motion/rest_motion.h"

// A sleeping island wakes when forces change, when what its bodies lie on moves or goes away, or
// when something awake comes within reach.
namespace dyop {

using dynamics_internal::BodyRecord;
using dynamics_internal::PairKey;

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

void World::Impl::put_to_sleep(const std::vector<dynamics_internal::Island>& islands,
                               const std::vector<dynamics_internal::IslandOutcome>& outcomes,
                               Scalar h, AdvanceReport& report) {
  if (options.sleep_steps <= 0) return;
  for (std::size_t i = 0; i < islands.size(); ++i) {
    Scalar rest_offset = kInfinity;
    bool may_sleep = outcomes[i].in_contact;
    bool touches = false;
    const TimeInterval next{time, time + h};
    for (const dynamics_internal::PairState* pair : islands[i].pairs) {
      rest_offset = std::min(rest_offset, pair->lengths.rest_offset);
      if (!pair->has_contacts) continue;
      touches = true;
      const auto moves = [&](const BodyRecord& body) {
        if (body.definition.kind != BodyKind::Kinematic) return false;
        const TimeInterval domain = body.definition.motion->domain();
        return moves_by_itself(body, {time, std::min(next.end, domain.end)});
      };
      may_sleep = may_sleep && !moves(bodies[pair->key.a]) && !moves(bodies[pair->key.b]) &&
                  !pair->granted && !pair->overlaps;
    }
    const auto hangs_on = [&](BodyId a, BodyId b) {
      touches = true;
      for (const BodyId id : {a, b}) {
        const BodyRecord& body = bodies[id.slot];
        rest_offset =
            std::min(rest_offset, kRestOffsetTargets * kTargetRadiusFraction * body.radius);
        const bool is_given = body.definition.kind == BodyKind::Kinematic;
        may_sleep = may_sleep && !(is_given && moves_by_itself(body, {time - h, time}));
      }
    };
    for (const dynamics_internal::JointState* joint : islands[i].joints) {
      hangs_on(joint->definition.a, joint->definition.b);
      may_sleep = may_sleep && !joint->definition.motor;
    }
    for (const dynamics_internal::SpringState* spring : islands[i].springs) {
      hangs_on(spring->definition.a, spring->definition.b);
    }
    may_sleep = may_sleep && touches;
    const Scalar way = kSleepRestOffsetFraction * rest_offset;
    // In a shorter time everything moves by less than `way`, even what falls.
    const Scalar fall = gravity_W.isZero(0) ? 0 : std::sqrt(2 * way / gravity_W.norm());
    const Scalar span = options.sleep_speed ? h : std::max(h, fall);
    const Scalar slow = options.sleep_speed.value_or(way / span);
    const Scalar steps = options.sleep_steps * (span / h);
    bool all_slow = may_sleep;
    for (const std::uint32_t slot : islands[i].bodies) {
      BodyRecord& body = bodies[slot];
      const Scalar speed = body.state.v_W.norm() + body.angular_velocity().norm() * body.radius;
      body.slow_steps = may_sleep && speed < slow ? body.slow_steps + 1 : 0;
      all_slow = all_slow && Scalar(body.slow_steps) >= steps;
    }
    if (!all_slow) continue;
    for (const std::uint32_t slot : islands[i].bodies) {
      BodyRecord& body = bodies[slot];
      body.is_asleep = true;
      body.state.v_W.setZero();
      body.state.L_W.setZero();
      body.flight = nullptr;
      body.rest = std::make_shared<RestMotion>(body.X_WB());
      if (body.definition.wrench) {
        body.wrench_asleep = total_wrench(body, gravity_W, time, body.motion_state());
      }
      report.fell_asleep.push_back(body.id);
    }
  }
}

}  // namespace dyop
