// SPDX-License-Identifier: BSD-3-Clause

// Which pairs of bodies may come near each other in a step.
#include <algorithm>
#include <utility>

#include "core/tolerance.h"
#include "dynamics/free_flight.h"
#include "dynamics/step/world_step.h"

namespace dyop::dynamics_internal {
namespace {

// Islands of so many bodies are worth a forecast.
constexpr std::size_t kForecastBodies = 1;
// They are also joined with what they would only come so near to, as contacts change velocities: this
// part of the pair's radius, and of the way that the two move relative to each other. Found by
// measurement: two and a half times as much changes nothing.
constexpr Scalar kForecastRadiusFraction = 0.02;
constexpr Scalar kForecastWayFraction = 0.1;

}  // namespace

// A box expected to hold the body over the whole step; checked afterwards.
AlignedBox WorldStep::predicted_box(const BodyRecord& body) {
  const TimeInterval interval{context_.t, context_.t_end};
  if (body.definition.kind == BodyKind::Kinematic) {
    return box_of(body, motion_move(body, body.definition.motion, context_.t));
  }
  if (!body.is_awake()) return box_around(body, body.X_WB(), 0);
  const Scalar h = interval.length();
  const Scalar way = h * (body.state.v_W.norm() + body.angular_velocity().norm() * body.radius +
                          h * world_.gravity_W.norm());
  // With a margin, so that contact pushes do not leave it.
  expected_way_[body.id.slot] = 1.25 * way;
  return box_around(body, body.X_WB(), 1.25 * way);
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
  const Scalar way = speed * interval.length() / 2;
  return box_around(body, move.motion->pose(interval.begin + interval.length() / 2), way);
}

// The box of a body at a pose, grown by `way` and by half the distance at which pairs matter.
AlignedBox WorldStep::box_around(const BodyRecord& body, const RigidPose& X_WB, Scalar way) const {
  const Vector3 half = X_WB.rotation().cwiseAbs() * (body.box_B.sizes() / 2);
  const Vector3 center = X_WB * Vector3(body.box_B.center());
  // Half of what the larger of two bodies needs; a pair's lengths are those of its smaller body.
  const Scalar radius = body.radius_B;
  const Scalar target = world_.options.target_distance.value_or(kTargetRadiusFraction * radius);
  const Scalar rest_offset = world_.options.rest_offset.value_or(
      kRestOffsetTargets * (target > 0 ? target : kTargetRadiusFraction * radius));
  const Scalar reach =
      target + (1 + kContactReachRestOffsets) * rest_offset + own_targets_[body.id.slot];
  // literal: generous for rounding, costs nothing
  const Scalar noise = 1e-9 * (center.cwiseAbs().maxCoeff() + radius);
  const Vector3 grow = half.array() + (way + reach + noise);
  return {center - grow, center + grow};
}

void WorldStep::find_candidates() {
  const TimeInterval interval{context_.t, context_.t_end};
  const std::size_t count = world_.bodies.size();
  may_move_.assign(count, false);
  expected_way_.assign(count, -1);
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
    if (world_.is_pair_enabled(key)) {
      if (is_known) {
        merged.push_back(std::move(*old));
      } else {
        auto pair = std::make_unique<PairState>();
        pair->key = key;
        pair->lengths = world_.lengths_of(key);
        update_pivot(*pair, world_.bodies[key.a], world_.bodies[key.b]);
        merged.push_back(std::move(pair));
      }
    }
    if (is_known) ++old;
  }
  while (old != world_.pairs.end()) keep_resting(*old++);
  world_.pairs = std::move(merged);
}

// Bodies that left their expected box may be near others than assumed.
bool WorldStep::find_new_candidates() {
  bool has_left = false;
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    for (std::size_t k = 0; k < islands_[i].bodies.size(); ++k) {
      const std::uint32_t slot = islands_[i].bodies[k];
      if (moves_[slot].is_rest) continue;
      if (outcomes_[i].tracks[k].most_way <= expected_way_[slot]) continue;
      const AlignedBox box = box_of(world_.bodies[slot], moves_[slot]);
      if (boxes_[slot].contains(box)) continue;
      boxes_[slot].extend(box);
      world_.broad_phase.update(static_cast<std::int32_t>(slot), boxes_[slot]);
      has_left = true;
    }
  }
  if (has_left) merge_pairs(world_.broad_phase.find_pairs(may_move_));
  return has_left;
}

// An island that meets another one has to run again with it. So it is joined beforehand with those
// that it would meet if all bodies kept their velocities. Returns whether there are any.
bool WorldStep::forecast_links() {
  const PartTimer timing(world_.options.measures_time, report_.times.proofs);
  const TimeInterval interval{context_.t, context_.t_end};
  const auto margin = [&](const PairState& pair, const BodyRecord& a, const BodyRecord& b) {
    const Scalar speed = (a.state.v_W - b.state.v_W).norm() +
                         a.angular_velocity().norm() * a.radius +
                         b.angular_velocity().norm() * b.radius;
    return std::min(kForecastRadiusFraction * pair.lengths.radius,
                    kForecastWayFraction * interval.length() * speed);
  };
  const auto kept_velocity = [&](const BodyRecord& body) {
    return twist_move(body, body.state, context_.t, body.state.v_W, body.angular_velocity());
  };
  bool has_links = false;
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (!a.is_awake() || !b.is_awake()) continue;
    if (island_of_[pair->key.a] == island_of_[pair->key.b]) continue;
    pair->start_from_committed();
    const Certificate certificate = certify(*pair, kept_velocity(a), kept_velocity(b), interval,
                                            pair->kept_distance() + margin(*pair, a, b),
                                            context_.limits, world_.workspaces.front()->toi);
    pair->commit_bounds();  // of the gap where the step begins
    if (certificate.result) add(report_.toi, certificate.result->statistics);
    if (certificate.proof) continue;
    forced_links_.insert(pair->key);
    has_links = true;
  }
  return has_links;
}

std::vector<PairKey> WorldStep::candidates() const {
  std::vector<PairKey> keys;
  for (const auto& pair : world_.pairs) {
    const BodyRecord& a = world_.bodies[pair->key.a];
    const BodyRecord& b = world_.bodies[pair->key.b];
    if (a.definition.is_sensor || b.definition.is_sensor) continue;
    if (a.is_dynamic() || b.is_dynamic()) keys.push_back(pair->key);
  }
  return keys;
}

// A step in which nothing moves.
void WorldStep::commit_rest() {
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
}

}  // namespace dyop::dynamics_internal
