// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/world_step.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/step/island.h"

namespace dyop::dynamics_internal {

namespace {

// Limit on merging rounds in one step; each adds at least one pair to an island.
constexpr int kMostMerges = 1000;
// Also merge with bodies passing within this fraction of the pair's radius / relative travel, since
// contacts change velocities. Found by measurement on poured spheres and hulls: with a quarter of
// it, an island of a thousand runs twice in most steps.
constexpr Scalar kForecastRadiusFraction = 0.1;
constexpr Scalar kForecastTravelFraction = 0.4;

// Sets of bodies that belong together.
class BodySets {
 public:
  explicit BodySets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0U);
  }
  void join(PairKey key) {
    const std::uint32_t a = root(key.a);
    const std::uint32_t b = root(key.b);
    parents_[std::max(a, b)] = std::min(a, b);
  }
  // The body with the lowest slot of the same set.
  std::uint32_t root(std::uint32_t slot) {
    while (parents_[slot] != slot) {
      parents_[slot] = parents_[parents_[slot]];
      slot = parents_[slot];
    }
    return slot;
  }

 private:
  std::vector<std::uint32_t> parents_;
};

}  // namespace

WorldStep::WorldStep(World::Impl& world, Scalar t_end, const AdvanceLimits& limits,
                     AdvanceReport& report)
    : world_(world),
      report_(report),
      boxes_(world.memory.boxes),
      islands_(world.memory.islands),
      outcomes_(world.memory.outcomes),
      moves_(world.memory.moves),
      known_moves_(world.memory.known_moves) {
  context_.options = &world.options;
  context_.gravity_W = world.gravity_W;
  context_.t = world.time;
  context_.t_end = t_end;
  context_.h = t_end - world.time;
  context_.bodies = &world.bodies;
  context_.limits = {world.options.max_node_pairs, limits.stop, limits.deadline};
}

// Motions of the user are not kept longer than needed.
WorldStep::~WorldStep() {
  forget_moves();
}

AdvanceStatus WorldStep::run() {
  world_.wake_what_changed({context_.t, context_.t_end}, report_);
  predict();
  if (!has_moving_) return commit_rest();
  pair();
  find_touching();
  for (int round = 0; round < kMostMerges; ++round) {
    if (round > 0) {
      predict();
      pair();
    }
    make_islands();
    if (round == 0 && foresee_hits()) make_islands();
    substep_islands();
    if (!(context_.t_end > context_.t)) break;
    RestProofs rest = prove_the_rest();
    if (rest.met.empty()) return commit(std::move(rest.proofs));
    join_islands(rest.met);
    if (context_.limits.is_late()) {
      give_up();
      return AdvanceStatus::BudgetExhausted;
    }
  }
  give_up();
  return status_or(AdvanceStatus::NumericalLimit);
}

// Predict and pair.

// Boxes that are expected to hold the bodies over the step, and which of them may move.
void WorldStep::predict() {
  const PartTimer timing(world_.options.measures_time, report_.times.broad_phase);
  const TimeInterval interval{context_.t, context_.t_end};
  const std::size_t count = world_.bodies.size();
  may_move_.assign(count, false);
  expected_travel_.assign(count, -1);
  own_targets_.assign(count, 0);
  for (const auto& [key, value] : world_.pair_target) {
    own_targets_[key.a] = std::max(own_targets_[key.a], value);
    own_targets_[key.b] = std::max(own_targets_[key.b], value);
  }
  has_moving_ = false;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const BodyRecord& body = world_.bodies[slot];
    if (!body.is_present()) continue;
    may_move_[slot] = body.is_awake() || world_.moves_by_itself(body, interval);
    has_moving_ = has_moving_ || may_move_[slot];
  }
  if (!has_moving_) return;
  // Boxes of earlier rounds of this step stay included.
  if (!is_planned_) boxes_.assign(count, AlignedBox());
  for (std::size_t slot = 0; slot < count; ++slot) {
    const BodyRecord& body = world_.bodies[slot];
    if (body.is_present()) boxes_[slot].extend(predicted_box(body));
    world_.broad_phase.update(static_cast<std::int32_t>(slot), boxes_[slot]);
  }
}

// A box expected to hold the body over the whole step; checked afterwards.
AlignedBox WorldStep::predicted_box(const BodyRecord& body) {
  const TimeInterval interval{context_.t, context_.t_end};
  if (body.definition.kind == BodyKind::Kinematic) {
    return box_of(body, motion_move(body, body.definition.motion, context_.t));
  }
  if (!body.is_awake()) return box_around(body, body.X_WB(), 0);
  const Scalar h = interval.length();
  const Scalar travel = h * (body.state.v_W.norm() + body.angular_velocity().norm() * body.radius +
                             h * world_.gravity_W.norm());
  // With a margin, so that contact pushes do not leave it.
  expected_travel_[body.id.slot] = 1.25 * travel;
  return box_around(body, body.X_WB(), 1.25 * travel);
}

// Half of what the larger of two bodies needs; a pair's lengths are those of its smaller body.
Scalar WorldStep::reach_of(Scalar size) const {
  const Scalar usual = kTargetRadiusFraction * size;
  const Scalar target = world_.options.target_distance.value_or(usual);
  const Scalar rest_offset =
      world_.options.rest_offset.value_or(kRestOffsetTargets * (target > 0 ? target : usual));
  return target + (1 + kContactReachRestOffsets) * rest_offset;
}

// Everything, unless the plane is across an axis of the world: then the pair's lengths are those of
// the other body, whichever it is.
AlignedBox WorldStep::box_around(const HalfSpace& half_space, const RigidPose& X_WB,
                                 Scalar travel) const {
  AlignedBox box(Vector3::Constant(-kLargestCoordinate), Vector3::Constant(kLargestCoordinate));
  Scalar largest = 0;
  Scalar own_target = 0;
  for (const BodyRecord& body : world_.bodies) {
    if (!as_half_space(*body.definition.shape)) largest = std::max(largest, body.size);
    own_target = std::max(own_target, own_targets_[body.id.slot]);
  }
  const Vector3 normal_W = X_WB.rotation() * half_space.normal();
  const Scalar height = half_space.offset() + normal_W.dot(X_WB.translation());
  // literal: generous for rounding, costs nothing
  const Scalar grow = travel + reach_of(largest) + own_target + 1e-9 * (std::abs(height) + largest);
  for (int k = 0; k < 3; ++k) {
    if (normal_W == Vector3::Unit(k)) box.max()[k] = height + grow;
    if (normal_W == -Vector3::Unit(k)) box.min()[k] = -height - grow;
  }
  return box;
}

// A box that holds the body at every time of the step: its box at the middle, grown by the largest
// distance any point can move in half of it and by half the distance at which pairs matter.
AlignedBox WorldStep::box_of(const BodyRecord& body, const BodyMove& move) const {
  const TimeInterval interval{context_.t, context_.t_end};
  return box_of(body, move, move.is_rest ? TwistBound{} : move.motion->twist_bound(interval));
}

AlignedBox WorldStep::box_of(const BodyRecord& body, const BodyMove& move,
                             const TwistBound& bound) const {
  const TimeInterval interval{context_.t, context_.t_end};
  const Scalar speed = bound.linear_speed + bound.angular_speed * body.radius_B;
  const Scalar travel = speed * interval.length() / 2;
  return box_around(body, move.motion->pose(interval.begin + interval.length() / 2), travel);
}

// The box of a body at a pose, grown by `way` and by half the distance at which pairs matter.
AlignedBox WorldStep::box_around(const BodyRecord& body, const RigidPose& X_WB,
                                 Scalar travel) const {
  if (const HalfSpace* half_space = as_half_space(*body.definition.shape)) {
    return box_around(*half_space, X_WB, travel);
  }
  const Vector3 half = X_WB.rotation().cwiseAbs() * (body.box_B.sizes() / 2);
  const Vector3 center = X_WB * Vector3(body.box_B.center());
  const Scalar reach = reach_of(body.size) + own_targets_[body.id.slot];
  // literal: generous for rounding, costs nothing
  const Scalar noise = 1e-9 * (center.cwiseAbs().maxCoeff() + body.radius_B);
  const Vector3 grow = half.array() + (travel + reach + noise);
  return {center - grow, center + grow};
}

// The pairs of bodies whose boxes meet.
void WorldStep::pair() {
  const PartTimer timing(world_.options.measures_time, report_.times.broad_phase);
  merge_pairs(world_.broad_phase.find_pairs(may_move_));
}

// Adds new pairs to the known ones; removes known ones no longer near, unless neither body may
// move.
void WorldStep::merge_pairs(const std::vector<std::pair<std::int32_t, std::int32_t>>& found) {
  std::vector<std::unique_ptr<PairState>> merged;
  merged.reserve(std::max(found.size(), world_.pairs.size()));
  auto old = world_.pairs.begin();
  const auto keep_resting = [&](std::unique_ptr<PairState>& pair) {
    const bool rests = !may_move_[pair->key.a] && !may_move_[pair->key.b];
    if (rests) merged.push_back(std::move(pair));
  };
  for (const auto& [a, b] : found) {
    const PairKey key{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)};
    while (old != world_.pairs.end() && (*old)->key < key) keep_resting(*old++);
    const bool is_known = old != world_.pairs.end() && (*old)->key == key;
    // The infinite box of a motion without bounds meets the empty boxes of absent bodies, too.
    const bool are_present = world_.bodies[key.a].is_present() && world_.bodies[key.b].is_present();
    if (are_present && world_.is_pair_enabled(key)) {
      if (is_known) {
        merged.push_back(std::move(*old));
      } else {
        auto pair = std::make_unique<PairState>();
        pair->key = key;
        pair->lengths = world_.lengths_of(key);
        pair->material = world_.material_of(key);
        update_pivot(*pair, world_.bodies[key.a], world_.bodies[key.b]);
        merged.push_back(std::move(pair));
      }
    }
    if (is_known) ++old;
  }
  while (old != world_.pairs.end()) keep_resting(*old++);
  world_.pairs = std::move(merged);
}

// Finds which bodies are within reach of each other; wakes sleepers that something awake reached.
void WorldStep::find_touching() {
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (!a.is_awake() && !b.is_awake()) continue;
    if (!a.is_dynamic() || !b.is_dynamic() || pair->has_contacts) continue;
    if (!is_examined(pair->key)) continue;
    const PairLengths& lengths = pair->lengths;
    const Scalar reach = lengths.rest_gap() + kContactReachRestOffsets * lengths.usual_rest_offset;
    if (pair->gap_committed > reach) continue;
    pair->start_from_committed();
    measure_gap(*pair, a, a.X_WB(), b, b.X_WB(), reach);
    pair->commit_bounds();
    pair->has_contacts = pair->gap_lower <= reach;
    if (!pair->has_contacts) continue;
    if (a.is_asleep) world_.wake(pair->key.a, &report_);
    if (b.is_asleep) world_.wake(pair->key.b, &report_);
  }
  for (const auto& pair : world_.pairs) {
    if (!pair->has_contacts) continue;
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (a.is_awake() && b.is_asleep) world_.wake(pair->key.b, &report_);
    if (b.is_awake() && a.is_asleep) world_.wake(pair->key.a, &report_);
  }
  for (const PairKey& link : world_.links) {
    const BodyRecord& a = world_.bodies[link.a];
    const BodyRecord& b = world_.bodies[link.b];
    if (a.is_awake() && b.is_asleep) world_.wake(b.id.slot, &report_);
    if (b.is_awake() && a.is_asleep) world_.wake(a.id.slot, &report_);
  }
  // Record the contacts now: a run may break them, and replanning must give the same islands.
  for (const auto& pair : world_.pairs) {
    if (pair->has_contacts) touching_.push_back(pair->key);
  }
}

// Make islands.

// Islands by contact, by links and by the hits of this step. Runs whose bodies are unchanged are
// kept; pairs that were found since then are not in them, and stay outside.
void WorldStep::make_islands() {
  BodySets sets(world_.bodies.size());
  const auto join = [&](PairKey key) {
    if (world_.bodies[key.a].is_awake() && world_.bodies[key.b].is_awake()) sets.join(key);
  };
  for (const PairKey& key : touching_) join(key);
  for (const PairKey& key : met_) join(key);
  for (const PairKey& link : world_.links) join(link);
  const auto root_of = [&](std::uint32_t slot) { return sets.root(slot); };

  IslandRuns kept;
  if (is_planned_) kept = world_.memory.take_runs(is_dirty_, report_);
  is_planned_ = true;
  is_dirty_.assign(world_.bodies.size(), false);
  const std::size_t island_count = number_islands(root_of);
  world_.memory.place_runs(island_count, std::move(kept));
  assign_pairs();
  assign_links();
}

// One island for each root, in order of slots. Returns how many there are.
std::size_t WorldStep::number_islands(const std::function<std::uint32_t(std::uint32_t)>& root_of) {
  const auto count = static_cast<std::uint32_t>(world_.bodies.size());
  std::size_t island_count = 0;
  island_of_.assign(count, -1);
  for (std::uint32_t slot = 0; slot < count; ++slot) {
    if (!world_.bodies[slot].is_awake()) continue;
    const std::uint32_t root = root_of(slot);
    if (root == slot) {
      island_of_[slot] = static_cast<std::int32_t>(island_count);
      if (++island_count > islands_.size()) islands_.emplace_back();
      islands_[island_count - 1].clear();
    }
    island_of_[slot] = island_of_[root];
    islands_[static_cast<std::size_t>(island_of_[slot])].bodies.push_back(slot);
    may_move_[slot] = true;  // also those that woke since the candidates were found
  }
  return island_count;
}

// A pair belongs to the island of its bodies, or of the one that can be moved.
void WorldStep::assign_pairs() {
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    const std::int32_t of_a = island_of_[pair->key.a];
    const std::int32_t of_b = island_of_[pair->key.b];
    const bool was_inner = pair->is_inner;
    pair->is_inner = false;
    if (a.definition.is_sensor || b.definition.is_sensor) continue;
    const bool is_inner = of_a >= 0 && of_a == of_b;
    const bool is_support = (of_a >= 0 && !b.is_dynamic()) || (of_b >= 0 && !a.is_dynamic());
    if (!is_inner && !is_support) continue;
    const auto island = static_cast<std::size_t>(std::max(of_a, of_b));
    if (outcomes_[island].has_run && !was_inner) continue;
    pair->is_inner = true;
    islands_[island].pairs.push_back(pair.get());
  }
}

// What acts between two bodies acts in the island of one of them; nowhere if one is not there.
void WorldStep::assign_links() {
  const auto island_with = [&](BodyId a, BodyId b) -> Island* {
    const std::int32_t island = std::max(island_of_[a.slot], island_of_[b.slot]);
    const bool is_present =
        world_.bodies[a.slot].is_present() && world_.bodies[b.slot].is_present();
    return is_present && island >= 0 ? &islands_[static_cast<std::size_t>(island)] : nullptr;
  };
  for (JointState& joint : world_.joints) {
    Island* island = island_with(joint.definition.a, joint.definition.b);
    if (island) island->joints.push_back(&joint);
  }
  for (SpringState& spring : world_.springs) {
    Island* island = island_with(spring.definition.a, spring.definition.b);
    if (island) island->springs.push_back(&spring);
  }
}

// An island that meets another one has to run again with it. So it is joined beforehand with those
// that it would meet if all bodies kept their velocities. Returns whether there are any.
bool WorldStep::foresee_hits() {
  const PartTimer timing(world_.options.measures_time, report_.times.proofs);
  const TimeInterval interval{context_.t, context_.t_end};
  const auto margin = [&](const PairState& pair, const BodyMove& a, const BodyMove& b) {
    const Scalar speed =
        (a.v_W - b.v_W).norm() + a.w_W.norm() * a.body->radius + b.w_W.norm() * b.body->radius;
    return std::min(kForecastRadiusFraction * pair.lengths.radius,
                    kForecastTravelFraction * interval.length() * speed);
  };
  forget_moves();
  const auto kept_velocity = [&](const BodyRecord& body) -> const BodyMove& {
    BodyMove& move = moves_[body.id.slot];
    if (!move.body) {
      known_moves_.push_back(body.id.slot);
      move = twist_move(body, body.state, context_.t, body.state.v_W, body.angular_velocity());
    }
    return move;
  };
  bool has_links = false;
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (!a.is_awake() || !b.is_awake() || !is_examined(pair->key)) continue;
    if (island_of_[pair->key.a] == island_of_[pair->key.b]) continue;
    pair->start_from_committed();
    const BodyMove& move_a = kept_velocity(a);
    const BodyMove& move_b = kept_velocity(b);
    const Certificate certificate = certify(*pair, move_a, move_b, interval,
                                            pair->kept_distance() + margin(*pair, move_a, move_b),
                                            context_.limits, world_.workspaces.front()->toi);
    pair->commit_bounds();  // of the gap where the step begins
    if (certificate.result) add(report_.toi, certificate.result->statistics);
    if (certificate.proof) continue;
    met_.insert(pair->key);
    has_links = true;
  }
  return has_links;
}

// Islands that met are joined; their bodies wake and are stepped again.
void WorldStep::join_islands(const std::vector<PairKey>& met) {
  for (const PairKey& key : met) {
    met_.insert(key);
    for (const std::uint32_t slot : {key.a, key.b}) {
      if (world_.bodies[slot].is_asleep) world_.wake(slot, &report_);
      is_dirty_[slot] = true;
    }
  }
}

// Substep islands.

// Each island from the committed states to the end of the step, then all to where the slowest came.
void WorldStep::substep_islands() {
  run_islands();
  shorten_to_reached();
}

void WorldStep::run_islands() {
  std::vector<std::size_t> todo;
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    if (!outcomes_[i].has_run || outcomes_[i].reached > context_.t_end) todo.push_back(i);
  }
  report_.work.islands += static_cast<std::int64_t>(todo.size());
  const auto run = [&](std::size_t k, StepWorkspace& workspace) {
    const std::size_t i = todo[k];
    if (is_alone(context_, islands_[i]) && !context_.limits.exceeded()) {
      fly_alone(context_, islands_[i], outcomes_[i]);
    } else {
      outcomes_[i] = IslandRun(context_, islands_[i], workspace).run();
    }
  };
  run_parallel(world_.options.thread_count, todo.size(), 1, world_.workspaces, run);
}

// An island that could not reach the end holds all others back.
void WorldStep::shorten_to_reached() {
  for (;;) {
    Scalar reached = context_.t_end;
    for (const IslandOutcome& outcome : outcomes_) reached = std::min(reached, outcome.reached);
    if (!(reached < context_.t_end)) return;
    context_.t_end = reached;
    if (!(reached > context_.t)) return;
    run_islands();
  }
}

// Prove the rest.

// Pairs between islands and with sleepers: proofs, and the pairs that met instead.
WorldStep::RestProofs WorldStep::prove_the_rest() {
  forget_moves();
  pair_what_left_its_box();
  RestProofs rest;
  const std::vector<PairState*> open = open_pairs(rest);
  bound_speeds(open);
  std::vector<Certificate> certificates(open.size());
  std::vector<Scalar> times(open.size(), 0);
  const auto prove = [&](std::size_t i, StepWorkspace& workspace) {
    const PartTimer timing(world_.options.measures_time, times[i]);
    prove_pair(*open[i], certificates[i], workspace.toi);
  };
  run_parallel(world_.options.thread_count, open.size(), 1, world_.workspaces, prove);
  report_.times.proofs = std::accumulate(times.begin(), times.end(), report_.times.proofs);
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (certificates[i].result) add(report_.toi, certificates[i].result->statistics);
    if (certificates[i].proof) {
      rest.proofs.push_back(*certificates[i].proof);
    } else {
      rest.met.push_back(open[i]->key);
    }
  }
  return rest;
}

const BodyMove& WorldStep::move_of(std::uint32_t slot) {
  if (!moves_[slot].body) {
    moves_[slot] = found_move(slot);
    known_moves_.push_back(slot);
  }
  return moves_[slot];
}

void WorldStep::forget_moves() {
  for (const std::uint32_t slot : known_moves_) moves_[slot] = {};
  known_moves_.clear();
  moves_.resize(world_.bodies.size());
}

BodyMove WorldStep::found_move(std::uint32_t slot) const {
  const BodyRecord& body = world_.bodies[slot];
  const std::int32_t island = island_of_[slot];
  if (island >= 0) {
    const Island& members = islands_[static_cast<std::size_t>(island)];
    const auto at = std::lower_bound(members.bodies.begin(), members.bodies.end(), slot);
    const Track& track = outcomes_[static_cast<std::size_t>(island)]
                             .tracks[static_cast<std::size_t>(at - members.bodies.begin())];
    BodyMove move;
    move.body = &body;
    move.motion = track.joined();
    move.is_rest = track.is_rest();
    move.center = body.state.X_WM.translation();
    return move;
  }
  if (body.definition.kind == BodyKind::Kinematic && may_move_[slot]) {
    return motion_move(body, body.definition.motion, context_.t);
  }
  return rest_move(body, body.rest);
}

// Bodies that left their predicted box need new candidate pairs.
void WorldStep::pair_what_left_its_box() {
  const PartTimer timing(world_.options.measures_time, report_.times.broad_phase);
  bool has_left = false;
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    for (std::size_t k = 0; k < islands_[i].bodies.size(); ++k) {
      const std::uint32_t slot = islands_[i].bodies[k];
      if (outcomes_[i].tracks[k].most_travel <= expected_travel_[slot]) continue;
      if (move_of(slot).is_rest) continue;
      const AlignedBox box = box_of(world_.bodies[slot], moves_[slot]);
      if (boxes_[slot].contains(box)) continue;
      boxes_[slot].extend(box);
      world_.broad_phase.update(static_cast<std::int32_t>(slot), boxes_[slot]);
      has_left = true;
    }
  }
  if (has_left) merge_pairs(world_.broad_phase.find_pairs(may_move_));
}

// The pairs that no island proves and of which something moves; the others are proven to rest.
std::vector<PairState*> WorldStep::open_pairs(RestProofs& rest) {
  std::vector<PairState*> open;
  for (const auto& pair : world_.pairs) {
    if (pair->is_inner || !is_examined(pair->key)) continue;
    const bool a_rests = move_of(pair->key.a).is_rest;
    const bool b_rests = move_of(pair->key.b).is_rest;
    if (a_rests && b_rests) {
      rest.proofs.push_back(PairProof::at_rest(pair->key, {context_.t, context_.t_end}));
      pair->start_from_committed();
    } else {
      open.push_back(pair.get());
    }
  }
  return open;
}

// Whether a pair has to be kept apart: one of its bodies can be moved, and none is a sensor.
bool WorldStep::is_examined(PairKey key) const {
  const BodyRecord& a = world_.bodies[key.a];
  const BodyRecord& b = world_.bodies[key.b];
  return (a.is_dynamic() || b.is_dynamic()) && !a.definition.is_sensor && !b.definition.is_sensor;
}

void WorldStep::bound_speeds(const std::vector<PairState*>& open) {
  std::vector<bool> is_bounded(moves_.size(), false);
  for (const PairState* pair : open) {
    for (const std::uint32_t slot : {pair->key.a, pair->key.b}) {
      if (is_bounded[slot]) continue;
      moves_[slot].bound_speed({context_.t, context_.t_end});
      is_bounded[slot] = true;
    }
  }
}

void WorldStep::prove_pair(PairState& pair, Certificate& certificate,
                           ToiWorkspace& workspace) const {
  pair.start_from_committed();
  certificate = certify(pair, moves_[pair.key.a], moves_[pair.key.b], {context_.t, context_.t_end},
                        pair.kept_distance(), context_.limits, workspace);
  if (certificate.result) pair.advancement_steps = certificate.result->statistics.node_pairs;
  pair.loosen_bounds(certificate.closing);
}

std::vector<PairKey> WorldStep::candidates() const {
  std::vector<PairKey> keys;
  for (const auto& pair : world_.pairs) {
    if (is_examined(pair->key)) keys.push_back(pair->key);
  }
  return keys;
}

// Commit.

// The proofs of all islands and of the rest: only a full ledger can be committed.
AdvanceStatus WorldStep::commit(std::vector<PairProof> proofs) {
  add_totals();
  report_crossings();
  for (const IslandOutcome& outcome : outcomes_) {
    proofs.insert(proofs.end(), outcome.proofs.begin(), outcome.proofs.end());
  }
  const AdvanceStatus status = status_or(AdvanceStatus::NotRun);
  const Ledger ledger({context_.t, context_.t_end}, candidates(), std::move(proofs));
  world_.commit(ledger, islands_, outcomes_, report_);
  return status;
}

// A step in which nothing moves.
AdvanceStatus WorldStep::commit_rest() {
  const TimeInterval interval{context_.t, context_.t_end};
  islands_.clear();
  outcomes_.clear();
  std::vector<PairKey> keys = candidates();
  std::vector<PairProof> proofs;
  proofs.reserve(keys.size());
  for (const PairKey& key : keys) proofs.push_back(PairProof::at_rest(key, interval));
  for (const auto& pair : world_.pairs) {
    pair->is_inner = false;
    pair->start_from_committed();
  }
  world_.commit(Ledger(interval, keys, std::move(proofs)), islands_, outcomes_, report_);
  return AdvanceStatus::NotRun;
}

// Nothing is committed; impacts at which the step was to stop are told.
void WorldStep::give_up() {
  add_totals();
  for (const IslandOutcome& outcome : outcomes_) {
    if (!outcome.stopped_at_impact) continue;
    report_.impacts.insert(report_.impacts.end(), outcome.impacts.begin(), outcome.impacts.end());
  }
}

// Why the first island that came no farther did so, or the status given.
AdvanceStatus WorldStep::status_or(AdvanceStatus otherwise) {
  bool stops = false;
  for (const IslandOutcome& outcome : outcomes_) {
    if (outcome.reached > context_.t_end) continue;
    stops = stops || outcome.stopped_at_impact;
    if (!outcome.failure) continue;
    const PairKey key = outcome.failure->pair;
    report_.offending_pair = {};
    if (key != PairKey{}) report_.offending_pair = {world_.id_at(key.a), world_.id_at(key.b)};
    return outcome.failure->status;
  }
  return stops ? AdvanceStatus::StoppedAtImpact : otherwise;
}

// Bodies on prescribed motions cannot react: those that come too near are reported, once.
void WorldStep::report_crossings() {
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (a.is_dynamic() || b.is_dynamic()) continue;
    if (a.definition.is_sensor || b.definition.is_sensor) continue;
    Certificate certificate;
    pair->overlaps = false;
    pair->uncertified_gap.reset();
    move_of(pair->key.a);
    move_of(pair->key.b);
    prove_pair(*pair, certificate, world_.workspaces.front()->toi);
    const bool is_clear = certificate.proof && certificate.proof->kind() != ProofKind::Excused;
    if (is_clear) {
      world_.crossed.erase(pair->key);
    } else if (world_.crossed.insert(pair->key).second) {
      report_.crossed.emplace_back(a.id, b.id);
    }
  }
}

void WorldStep::add_totals() {
  for (const IslandOutcome& outcome : outcomes_) {
    StepStatistics& sum = report_.work;
    sum.substeps += outcome.work.substeps;
    sum.rounds += outcome.work.rounds;
    sum.stalls += outcome.work.stalls;
    sum.contacts = std::max(sum.contacts, outcome.work.contacts);
    sum.residual = std::max(sum.residual, outcome.work.residual);
    add_cost(report_, outcome);
  }
}

}  // namespace dyop::dynamics_internal
