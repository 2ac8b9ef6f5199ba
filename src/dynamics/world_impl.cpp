// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/world_impl.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/step/world_step.h"
#include "dyop/core/error.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop {

using dynamics_internal::BodyRecord;
using dynamics_internal::JointState;
using dynamics_internal::PairKey;
using dynamics_internal::PairState;

namespace {

std::int64_t& count_of(ProofKind kind, StepStatistics& work) {
  switch (kind) {
    case ProofKind::ByBound:
      return work.pairs_by_bound;
    case ProofKind::ByQuery:
      return work.pairs_by_query;
    case ProofKind::AtRest:
      return work.pairs_at_rest;
    case ProofKind::Excused:
      break;
  }
  return work.pairs_excused;
}

}  // namespace

World::Impl::Impl(const WorldOptions& the_options)
    : options(the_options), gravity_W(the_options.gravity_W) {
  workspaces.push_back(std::make_unique<dynamics_internal::StepWorkspace>());
}

BodyRecord& World::Impl::record(BodyId id) {
  DYOP_REQUIRE(id.slot < bodies.size() && bodies[id.slot].exists && bodies[id.slot].id == id,
               "World: there is no body ", id, " among ", count);
  return bodies[id.slot];
}

const BodyRecord& World::Impl::record(BodyId id) const {
  return const_cast<Impl*>(this)->record(id);
}

void World::Impl::restart(BodyRecord& body) {
  body.flight = nullptr;
  body.slow_steps = 0;
  body.rest = std::make_shared<RestMotion>(body.X_WB());
  ++revision;
}

bool World::Impl::moves_by_itself(const BodyRecord& body, const TimeInterval& interval) const {
  if (!body.is_present() || body.definition.kind != BodyKind::Kinematic) return false;
  const TwistBound bound = body.definition.motion->twist_bound(interval);
  return bound.linear_speed > 0 || bound.angular_speed > 0;
}

dynamics_internal::PairLengths World::Impl::lengths_of(PairKey key) const {
  dynamics_internal::PairLengths lengths;
  lengths.radius = std::min(bodies[key.a].size, bodies[key.b].size);
  const auto own = pair_target.find(key);
  const Scalar usual = kTargetRadiusFraction * lengths.radius;
  lengths.target = own != pair_target.end() ? own->second : options.target_distance.value_or(usual);
  lengths.rest_offset = options.rest_offset.value_or(
      kRestOffsetTargets *
      (own == pair_target.end() && lengths.target > 0 ? lengths.target : usual));
  lengths.usual_rest_offset = lengths.rest_offset;
  return lengths;
}

bool World::Impl::is_pair_enabled(PairKey key) const {
  if (std::binary_search(joined.begin(), joined.end(), key)) return false;
  const auto found = pair_enabled.find(key);
  if (found != pair_enabled.end()) return found->second;
  return bodies[key.a].definition.filter.accepts(bodies[key.b].definition.filter);
}

namespace {

Scalar combine(CombineRule rule, Scalar a, Scalar b) {
  switch (rule) {
    case CombineRule::GeometricMean:
      return std::sqrt(a * b);
    case CombineRule::Mean:
      return (a + b) / 2;
    case CombineRule::Product:
      return a * b;
    case CombineRule::Minimum:
      return std::min(a, b);
    case CombineRule::Maximum:
      break;
  }
  return std::max(a, b);
}

}  // namespace

Material World::Impl::material_of(PairKey key) const {
  const auto own = pair_material.find(key);
  if (own != pair_material.end()) return own->second;
  const BodyDefinition& a = bodies[key.a].definition;
  const BodyDefinition& b = bodies[key.b].definition;
  return {combine(options.combine_restitution, a.restitution, b.restitution),
          combine(options.combine_friction, a.friction, b.friction),
          std::max(a.rolling_friction, b.rolling_friction),
          std::max(a.torsional_friction, b.torsional_friction)};
}

void World::Impl::renew_materials(std::uint32_t slot) {
  for (const auto& pair : pairs) {
    if (pair->key.a != slot && pair->key.b != slot) continue;
    pair->material = material_of(pair->key);
    if (!pair->has_contacts) continue;
    wake(pair->key.a, nullptr);
    wake(pair->key.b, nullptr);
  }
}

void World::Impl::renew_pairs_of(std::uint32_t slot) {
  wake(slot, nullptr);
  for (const auto& pair : pairs) {
    if (!pair->has_contacts) continue;
    if (pair->key.a == slot) wake(pair->key.b, nullptr);
    if (pair->key.b == slot) wake(pair->key.a, nullptr);
  }
  drop_pairs_of(slot);
}

void World::Impl::remake(BodyRecord& body, BodyDefinition definition) {
  const MotionState initial = std::exchange(definition.initial, body.motion_state());
  dynamics_internal::require_valid(definition);
  BodyRecord made = dynamics_internal::make_body_record(body.id, definition, time);
  made.definition.initial = initial;
  made.is_enabled = body.is_enabled;
  wake(body.id.slot, nullptr);
  body = std::move(made);
  ++revision;
  note_set(body, nullptr);
  broad_phase.update(static_cast<std::int32_t>(body.id.slot), AlignedBox());
}

dynamics_internal::JointState& World::Impl::joint_at(JointId id) {
  const auto found =
      std::find_if(joints.begin(), joints.end(), [&](const auto& joint) { return joint.id == id; });
  DYOP_REQUIRE(found != joints.end(), "World: there is no joint ", id.number);
  return *found;
}

dynamics_internal::SpringState& World::Impl::spring_at(SpringId id) {
  const auto found = std::find_if(springs.begin(), springs.end(),
                                  [&](const auto& spring) { return spring.id == id; });
  DYOP_REQUIRE(found != springs.end(), "World: there is no spring ", id.number);
  return *found;
}

void World::Impl::find_links() {
  ++rules_version;
  links.clear();
  joined.clear();
  for (dynamics_internal::JointState& joint : joints) {
    const JointDefinition& definition = joint.definition;
    links.push_back({definition.a.slot, definition.b.slot});
    if (!definition.bodies_collide) {
      joined.push_back(dynamics_internal::ordered(definition.a.slot, definition.b.slot));
    }
    if (definition.kind != JointKind::Coupling) continue;
    joint.coupled = {&joint_at(definition.first), &joint_at(definition.second)};
  }
  std::sort(joined.begin(), joined.end());
  for (const dynamics_internal::SpringState& spring : springs) {
    links.push_back({spring.definition.a.slot, spring.definition.b.slot});
  }
}

void World::Impl::remove_joints(const std::function<bool(const JointState&)>& is_removed) {
  std::set<JointId> gone;
  for (const JointState& joint : joints) {
    if (is_removed(joint)) gone.insert(joint.id);
  }
  std::vector<PairKey> uncoupled;
  std::erase_if(joints, [&](const JointState& joint) {
    const JointDefinition& definition = joint.definition;
    if (gone.contains(joint.id)) return true;
    const bool has_lost = definition.kind == JointKind::Coupling &&
                          (gone.contains(definition.first) || gone.contains(definition.second));
    if (has_lost) {
      uncoupled.push_back(dynamics_internal::ordered(definition.a.slot, definition.b.slot));
    }
    return has_lost;
  });
  find_links();
  for (const PairKey& key : uncoupled) forget_pair(key);
}

void World::Impl::break_joints(const std::vector<dynamics_internal::Island>& islands,
                               AdvanceReport& report) {
  std::vector<JointId> broken;
  std::vector<PairKey> parted;
  for (const dynamics_internal::Island& island : islands) {
    for (const JointState* joint : island.joints) {
      const JointDefinition& definition = joint->definition;
      const Scalar force = joint->force_W.norm();
      const Scalar torque = joint->torque_W.norm();
      if (!(force > definition.break_force || torque > definition.break_torque)) continue;
      report.broken_joints.push_back(
          {joint->id, definition.name, definition.a, definition.b, time, force, torque});
      broken.push_back(joint->id);
      parted.push_back(dynamics_internal::ordered(definition.a.slot, definition.b.slot));
    }
  }
  if (broken.empty()) return;
  remove_joints([&](const JointState& joint) {
    return std::find(broken.begin(), broken.end(), joint.id) != broken.end();
  });
  for (const PairKey& key : parted) forget_pair(key);
}

// After a change to the rules between two bodies: both wake up.
void World::Impl::forget_pair(PairKey key) {
  std::erase_if(pairs, [&](const auto& pair) { return pair->key == key; });
  rouse(key.a);
  rouse(key.b);
}

void World::Impl::rouse(std::uint32_t slot) {
  wake(slot, nullptr);
  bodies[slot].flight = nullptr;
}

void World::Impl::drop_pairs_of(std::uint32_t slot) {
  std::erase_if(pairs,
                [&](const auto& pair) { return pair->key.a == slot || pair->key.b == slot; });
}

PairRecord World::Impl::record_of(const PairState& pair) const {
  PairRecord record;
  record.a = bodies[pair.key.a].id;
  record.b = bodies[pair.key.b].id;
  record.proof = pair.proof;
  record.gap_lower = std::max(pair.gap_committed, 0.0);
  record.gap_upper = pair.gap_upper_committed;
  record.advancement_steps = pair.advancement_steps;
  record.residual = pair.residual;
  record.pivot_W = pair.pivot.p_W;
  record.nhat_AB_W = pair.pivot.nhat_AB_W;
  if (!pair.has_contacts) return record;
  const auto points = pair.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    record.contacts.push_back(
        {points[i], i < pair.impulses.size() ? pair.impulses[i] : Vector3::Zero()});
  }
  const auto nearest =
      std::min_element(points.begin(), points.end(),
                       [](const ContactPoint& x, const ContactPoint& y) { return x.gap < y.gap; });
  if (nearest == points.end()) return record;
  record.gap_upper = std::min(record.gap_upper, (nearest->p_WCb - nearest->p_WCa).norm());
  record.gap_upper = std::max(record.gap_upper, record.gap_lower);
  return record;
}

void World::Impl::note_set(const BodyRecord& body, AdvanceReport* report) {
  if (!options.records_impulses || !body.is_dynamic()) return;
  VelocityChange change;
  change.interval = {time, time};
  MomentumChange& set = change.bodies.emplace_back();
  set.body = body.id;
  set.v_W = body.state.v_W;
  set.L_W = body.state.L_W;
  (report != nullptr ? report->velocity_changes : changes_before).push_back(std::move(change));
}

// In the order in which others rely on it: bodies, then pairs, then sensors and sleep.
void World::Impl::commit(const dynamics_internal::Ledger& ledger,
                         const std::vector<dynamics_internal::Island>& islands,
                         std::vector<dynamics_internal::IslandOutcome>& outcomes,
                         AdvanceReport& report) {
  CommittedStep step;
  step.interval = ledger.interval();
  const bool has_sensors = std::any_of(bodies.begin(), bodies.end(), [](const BodyRecord& body) {
    return body.definition.is_sensor;
  });
  if (options.records_motions || has_sensors) step.motions.resize(bodies.size());
  commit_unmoved(step);
  commit_islands(islands, outcomes, step);
  for (dynamics_internal::IslandOutcome& outcome : outcomes) {
    std::move(outcome.changes.begin(), outcome.changes.end(),
              std::back_inserter(report.velocity_changes));
  }
  add_impacts(outcomes, report);
  commit_pairs(ledger, report);
  time = step.interval.end;
  ++revision;
  ++report.work.steps;
  sense(step, report);
  tell_contacts(outcomes, report);
  put_to_sleep(islands, outcomes, step.interval.length(), report);
  break_joints(islands, report);
  if (options.records_motions) report.steps.push_back(std::move(step));
}

// Bodies that rest or follow a prescribed motion.
void World::Impl::commit_unmoved(CommittedStep& step) {
  for (std::size_t slot = 0; slot < bodies.size(); ++slot) {
    BodyRecord& body = bodies[slot];
    if (!body.is_present()) continue;
    if (!step.motions.empty()) step.motions[slot] = body.rest;
    if (moves_by_itself(body, step.interval)) {
      if (!step.motions.empty()) step.motions[slot] = body.definition.motion;
      body.state = central_state(body, body.definition.motion->state(step.interval.end));
      body.rest = std::make_shared<RestMotion>(body.X_WB());
    } else if (body.definition.kind == BodyKind::Kinematic) {
      body.state.v_W.setZero();
      body.state.L_W.setZero();
    }
  }
}

void World::Impl::commit_islands(const std::vector<dynamics_internal::Island>& islands,
                                 std::vector<dynamics_internal::IslandOutcome>& outcomes,
                                 CommittedStep& step) {
  for (std::size_t i = 0; i < islands.size(); ++i) {
    for (JointState* joint : islands[i].joints) joint->commit(step.interval.length());
    for (std::size_t k = 0; k < islands[i].bodies.size(); ++k) {
      const std::uint32_t slot = islands[i].bodies[k];
      dynamics_internal::Track& track = outcomes[i].tracks[k];
      if (!step.motions.empty()) step.motions[slot] = track.joined();
      bodies[slot].state = track.end;
      bodies[slot].flight = std::move(track.flight);
    }
  }
}

void World::Impl::add_impacts(const std::vector<dynamics_internal::IslandOutcome>& outcomes,
                              AdvanceReport& report) const {
  for (const dynamics_internal::IslandOutcome& outcome : outcomes) {
    report.impacts.insert(report.impacts.end(), outcome.impacts.begin(), outcome.impacts.end());
  }
  std::stable_sort(report.impacts.begin(), report.impacts.end(),
                   [](const ImpactEvent& x, const ImpactEvent& y) { return x.t < y.t; });
}

// Gaps, pivots, and how each pair was proven.
void World::Impl::commit_pairs(const dynamics_internal::Ledger& ledger, AdvanceReport& report) {
  auto entry = ledger.entries().begin();
  for (const auto& pair : pairs) {
    pair->commit_bounds();
    if (pair->has_contacts) {
      report.work.shortest_gap = std::min(report.work.shortest_gap, pair->shortest_gap());
    }
    const bool has_entry = entry != ledger.entries().end() && entry->key == pair->key;
    if (!has_entry || entry->kind != ProofKind::AtRest) {
      update_pivot(*pair, bodies[pair->key.a], bodies[pair->key.b]);
    }
    if (!has_entry) continue;
    const bool is_new = pair->proof != entry->kind;
    pair->proof = entry->kind;
    ++entry;
    ++count_of(pair->proof, report.work);
    const std::pair<BodyId, BodyId> ids(id_at(pair->key.a), id_at(pair->key.b));
    if (pair->proof == ProofKind::Excused && is_new) {
      report.too_near.push_back(ids);
      std::erase(report.parted, ids);
      pair->was_too_near = true;
    }
    if (pair->was_too_near && !pair->uncertified_gap && !pair->overlaps) {
      report.parted.push_back(ids);
      pair->was_too_near = false;
    }
  }
}

// Which pairs have begun to touch, and which no longer do, at the World's time and in the impacts
// of the step that led there.
void World::Impl::tell_contacts(const std::vector<dynamics_internal::IslandOutcome>& outcomes,
                                AdvanceReport& report) {
  std::map<PairKey, Scalar> met;  // first times
  for (const dynamics_internal::IslandOutcome& outcome : outcomes) {
    for (const ImpactEvent& event : outcome.impacts) {
      for (const WorldContact& contact : event.contacts) {
        met.emplace(dynamics_internal::ordered(contact.a.slot, contact.b.slot), event.t);
      }
    }
  }
  std::vector<PairKey> now;
  for (const auto& pair : pairs) {
    if (!pair->has_contacts) continue;
    const dynamics_internal::PairLengths& lengths = pair->lengths;
    const bool is_near = pair->shortest_gap() <= lengths.rest_gap() + 0.5 * lengths.rest_offset;
    if (is_near || std::binary_search(touching.begin(), touching.end(), pair->key)) {
      now.push_back(pair->key);
    }
  }
  const auto tell = [&](PairKey key, Scalar t, bool is_begin) {
    if (!bodies[key.a].is_present() || !bodies[key.b].is_present()) return;
    report.contact_events.push_back({id_at(key.a), id_at(key.b), t, is_begin});
  };
  std::map<PairKey, int> changes;  // of all pairs of before, now and between
  for (const PairKey& key : touching) changes[key] |= 1;
  for (const PairKey& key : now) changes[key] |= 2;
  for (const auto& [key, t] : met) changes[key] |= 4;
  for (const auto& [key, change] : changes) {
    const bool was = (change & 1) != 0;
    const bool is = (change & 2) != 0;
    if (!was) tell(key, (change & 4) != 0 ? met.at(key) : time, true);
    if (!is) tell(key, time, false);
  }
  touching = std::move(now);
}

AdvanceReport World::Impl::advance(Scalar dt, const AdvanceLimits& limits) {
  DYOP_REQUIRE(dt > 0 && dt < kInfinity, "World::advance: dt must be finite and > 0, not ", dt);
  const Scalar t_end = time + dt;
  for (const BodyRecord& body : bodies) {
    if (!body.is_present() || body.definition.kind != BodyKind::Kinematic) continue;
    const std::string what = "the motion of body '" + body.definition.name + "'";
    require_defined(*body.definition.motion, {time, t_end}, what.c_str());
  }
  DYOP_REQUIRE(limits.max_steps > 0, "World::advance: max_steps must be > 0, not ",
               limits.max_steps);
  AdvanceReport report;
  report.velocity_changes = std::exchange(changes_before, {});
  report.placed = std::exchange(placed, {});
  Scalar total = 0;
  {
    const dynamics_internal::PartTimer timing(options.measures_time, total);
    advance_steps(dt, limits, report);
  }
  if (report.status == AdvanceStatus::NotRun) report.status = AdvanceStatus::Completed;
  report.t = time;
  report.times.total = total;
  return report;
}

void World::Impl::advance_steps(Scalar dt, const AdvanceLimits& limits, AdvanceReport& report) {
  const Scalar t_begin = time;
  const Scalar t_end = time + dt;
  const Scalar step = options.max_step.value_or(dt);
  // literal: rounding of dt / step must not add a step
  const auto parts = std::max(1.0, std::ceil(dt / step - 1e-9));
  constexpr int kMostEventsAtOnce = 100;
  int events_at_once = 0;
  for (Scalar k = 1; k <= parts && report.status == AdvanceStatus::NotRun;) {
    const Scalar t_next = k == parts ? t_end : t_begin + dt * (k / parts);
    if (limits.stop.stop_requested()) {
      report.status = AdvanceStatus::Cancelled;
      break;
    }
    const bool is_late = limits.deadline && std::chrono::steady_clock::now() >= *limits.deadline;
    if (is_late || report.work.steps >= limits.max_steps) {
      report.status = AdvanceStatus::BudgetExhausted;
      break;
    }
    const Scalar t_before = time;
    report.status = dynamics_internal::WorldStep(*this, t_next, limits, report).run();
    if (report.status == AdvanceStatus::StoppedAtImpact &&
        options.policy == ImpactPolicy::Callback) {
      events_at_once = time > t_before ? 0 : events_at_once + 1;
      answer_by_callback(report);
      report.status =
          events_at_once < kMostEventsAtOnce ? AdvanceStatus::NotRun : AdvanceStatus::Blocked;
      if (report.status == AdvanceStatus::Blocked) {
        report.offending_pair = {report.impacts.back().a, report.impacts.back().b};
      }
    }
    if (time > t_before && options.on_step) options.on_step(time);
    if (time >= t_next) ++k;
  }
}

void World::Impl::answer_by_callback(AdvanceReport& report) {
  const ImpactEvent& event = report.impacts.back();
  const PairKey key = dynamics_internal::ordered(event.a.slot, event.b.slot);
  for (const auto& pair : pairs) {
    if (pair->key == key) pair->answered_at = time;
  }
  BodyRecord& a = record(event.a);
  BodyRecord& b = record(event.b);
  ImpactStates states{a.motion_state(), b.motion_state()};
  options.on_impact(event, states);
  const auto take_over = [&](BodyRecord& body, const MotionState& state) {
    if (!body.is_dynamic()) return;
    DYOP_REQUIRE(state.twist.v_WB.allFinite() && state.twist.w_WB.allFinite(), "body '",
                 body.definition.name, "': on_impact wrote a velocity that is not finite");
    body.state = central_state(body, state);
    restart(body);
    note_set(body, &report);
  };
  take_over(a, states.a);
  take_over(b, states.b);
}

// Overlaps with sensors over a committed step. A body that only passes through within the step
// gives both events, begin and end.
void World::Impl::sense(const CommittedStep& step, AdvanceReport& report) {
  std::set<PairKey> lost = overlapping_sensors;  // that have no pair any more
  for (const auto& pair : pairs) {
    const PairKey key = pair->key;
    const BodyRecord& a = bodies[key.a];
    const BodyRecord& b = bodies[key.b];
    if (a.definition.is_sensor == b.definition.is_sensor) continue;
    const BodyId sensor = a.definition.is_sensor ? a.id : b.id;
    const BodyId body = a.definition.is_sensor ? b.id : a.id;
    const Scalar t = step.interval.end;
    const bool was = lost.erase(key) > 0;
    const bool is =
        distance(*a.definition.shape, a.X_WB(), *b.definition.shape, b.X_WB()).lower <= 0;
    if (was && !is) {
      overlapping_sensors.erase(key);
      report.sensors.push_back({sensor, body, t, false});
    }
    if (was || !step.motions[key.a] || !step.motions[key.b]) continue;
    ToiOptions query;
    query.distance_tolerance = pair->lengths.tolerance();
    query.max_node_pairs = options.max_node_pairs;
    const ToiResult met =
        time_of_impact(*a.definition.shape, *step.motions[key.a], *b.definition.shape,
                       *step.motions[key.b], step.interval, query);
    if (met.status == ToiStatus::Separated && !is) continue;
    report.sensors.push_back({sensor, body, met.t_safe, true});
    if (is) {
      overlapping_sensors.insert(key);
    } else {
      report.sensors.push_back({sensor, body, t, false});
    }
  }
  end_overlaps(lost, step.interval.end, report);
}

// What was moved away, disabled or filtered since. Bodies at rest may overlap without a pair.
void World::Impl::end_overlaps(const std::set<PairKey>& lost, Scalar t, AdvanceReport& report) {
  for (const PairKey& key : lost) {
    const BodyRecord& a = bodies[key.a];
    const BodyRecord& b = bodies[key.b];
    const bool may_overlap = a.is_present() && b.is_present() && is_pair_enabled(key);
    if (may_overlap &&
        distance(*a.definition.shape, a.X_WB(), *b.definition.shape, b.X_WB()).lower <= 0) {
      continue;
    }
    overlapping_sensors.erase(key);
    const bool is_a = a.definition.is_sensor;
    report.sensors.push_back({is_a ? a.id : b.id, is_a ? b.id : a.id, t, false});
  }
}

struct WorldSnapshot::State {
  const void* world = nullptr;  // the World it was taken from
  Vector3 gravity_W;
  Scalar time = 0;
  std::deque<dynamics_internal::BodyRecord> bodies;
  std::vector<std::uint32_t> free_slots;
  std::size_t count = 0;
  dynamics_internal::BroadPhase broad_phase;
  std::vector<dynamics_internal::PairState> pairs;
  std::map<dynamics_internal::PairKey, bool> pair_enabled;
  std::map<dynamics_internal::PairKey, Scalar> pair_target;
  std::map<dynamics_internal::PairKey, Material> pair_material;
  std::vector<dynamics_internal::PairKey> touching;
  std::deque<dynamics_internal::JointState> joints;
  std::uint64_t next_joint = 0;
  std::deque<dynamics_internal::SpringState> springs;
  std::uint64_t next_spring = 0;
  std::set<dynamics_internal::PairKey> overlapping_sensors;
  std::set<dynamics_internal::PairKey> crossed;
};

WorldSnapshot World::snapshot() {
  auto state = std::make_shared<WorldSnapshot::State>();
  for (dynamics_internal::BodyRecord& body : impl_->bodies) body.flight = nullptr;
  state->world = impl_.get();
  state->gravity_W = impl_->gravity_W;
  state->time = impl_->time;
  state->bodies = impl_->bodies;
  state->free_slots = impl_->free_slots;
  state->count = impl_->count;
  state->broad_phase = impl_->broad_phase;
  for (const auto& pair : impl_->pairs) state->pairs.push_back(*pair);
  state->pair_enabled = impl_->pair_enabled;
  state->pair_target = impl_->pair_target;
  state->pair_material = impl_->pair_material;
  state->touching = impl_->touching;
  state->joints = impl_->joints;
  state->next_joint = impl_->next_joint;
  state->springs = impl_->springs;
  state->next_spring = impl_->next_spring;
  state->overlapping_sensors = impl_->overlapping_sensors;
  state->crossed = impl_->crossed;
  WorldSnapshot snapshot;
  snapshot.state_ = std::move(state);
  return snapshot;
}

void World::restore(const WorldSnapshot& snapshot) {
  DYOP_REQUIRE(snapshot.state_ && snapshot.state_->world == impl_.get(),
               "World: the snapshot is of another World");
  const WorldSnapshot::State& state = *snapshot.state_;
  impl_->gravity_W = state.gravity_W;
  impl_->time = state.time;
  impl_->bodies = state.bodies;
  impl_->free_slots = state.free_slots;
  impl_->count = state.count;
  impl_->broad_phase = state.broad_phase;
  impl_->pairs.clear();
  for (const dynamics_internal::PairState& pair : state.pairs) {
    impl_->pairs.push_back(std::make_unique<dynamics_internal::PairState>(pair));
  }
  impl_->pair_enabled = state.pair_enabled;
  impl_->pair_target = state.pair_target;
  impl_->pair_material = state.pair_material;
  impl_->touching = state.touching;
  impl_->joints = state.joints;
  impl_->next_joint = state.next_joint;
  impl_->springs = state.springs;
  impl_->next_spring = state.next_spring;
  impl_->find_links();
  ++impl_->revision;
  impl_->overlapping_sensors = state.overlapping_sensors;
  impl_->crossed = state.crossed;
  ++impl_->rules_version;
  for (const dynamics_internal::BodyRecord& body : impl_->bodies) {
    if (!body.exists) continue;
    impl_->placed.push_back(body.id);
    impl_->note_set(body, nullptr);
  }
}

}  // namespace dyop
