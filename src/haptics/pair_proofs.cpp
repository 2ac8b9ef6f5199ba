// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/pair_proofs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tolerance.h"

namespace dyop::haptics_internal {
namespace {

// Tolerance of impacts as a fraction of the rest offset; the rest of it is for the difference
// between a step and its linear approximation.
constexpr Scalar kToleranceShare = 0.3;

// The first level of a pair keeps this fraction of the tolerance more than the last; see
// set_band().
constexpr Scalar kRaisedShare = 0x1p-3;
constexpr int kMostLevels = 40;

// A band must end so many times the noise of a motion below a pair's distance.
constexpr Scalar kBandNoises = 4;

// Node pairs that a query may hold for one time interval without growing its memory.
constexpr std::size_t kQueuedPairs = 512;

// So many pairs to ask about need no further memory.
constexpr std::size_t kReservedPairs = 4096;

// A distance is measured again when its bounds are farther apart than this fraction of the rest
// offset and than the options allow.
constexpr Scalar kVagueShare = 0.25;

// It is then measured to this fraction of what is allowed, so that it lasts a while.
constexpr Scalar kMeasuredShare = 0.9;

// Checkpoints for pairs that crossed, after a tick was cut off.
constexpr std::int64_t kCrossingWork = 2000;

}  // namespace

PairProofs::PairProofs(const LoopScene& scene)
    : scene_(scene), tolerance_(kToleranceShare * scene.options.rest_offset) {
  memory_.workspace.reserve(kQueuedPairs);
  memory_.pairs.reserve(kReservedPairs);
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    first_pair_.push_back(pairs_.size());
    const std::size_t obstacles = scene.obstacles_of(scene.bodies[body].tool);
    for (std::size_t obstacle = 0; obstacle < obstacles; ++obstacle) {
      ProxyPair& pair = pairs_.emplace_back();
      pair.body = body;
      pair.obstacle = obstacle;
      const Obstacle& other = *scene.obstacles[obstacle];
      if (other.is_hard()) other.prepare(scene.bodies[body], memory_);
    }
  }
  loose_.reserve(pairs_.size());
}

void PairProofs::start_motion() {
  for (ProxyPair& pair : pairs_) pair.proven = kInfinity;
}

// The obstacle is another mesh now.
void PairProofs::forget(std::size_t obstacle) {
  for (ProxyPair& pair : pairs_) {
    if (pair.obstacle != obstacle) continue;
    pair.distance = {};
    pair.is_overlapping = false;
    pair.is_new = true;
    pair.eased_from = 0;
    pair.level = 0;
    for (PieceMemory& kept : pair.kept) kept.restart();
  }
}

void PairProofs::measure_new(const ToolPoses& poses, TickStatistics& work) {
  WorkClock endless;
  WorkShare all(endless);
  for (ProxyPair& pair : pairs_) {
    const bool is_unknown = pair.is_new && !(pair.distance.upper < kInfinity);
    if (!is_unknown || !scene_.obstacles[pair.obstacle]->is_hard()) continue;
    measure(poses, pair, {}, all, work);
  }
}

ToolSet PairProofs::measure_crossing(const ToolPoses& poses, TickStatistics& work) {
  ToolSet recovering;
  WorkClock endless;
  WorkShare share(endless, kCrossingWork);
  for (ProxyPair& pair : pairs_) {
    if (!pair.is_overlapping || share.is_used_up()) continue;
    const Scalar margin = scene_.obstacles[pair.obstacle]->margin;
    const Scalar rest = scene_.options.rest_offset;
    measure(poses, pair, {margin + rest, rest, kVagueShare * rest}, share, work);
    const Scalar lower = pair.distance.lower;
    pair.is_overlapping = !(lower > 0);
    const bool is_within = lower > 0 && lower <= margin;
    if (is_within) recovering |= tools_of(pair);
  }
  return recovering;
}

NewNeighbours PairProofs::beside_new() const {
  NewNeighbours tools;
  for (const ProxyPair& pair : pairs_) {
    const Obstacle& obstacle = *scene_.obstacles[pair.obstacle];
    if (!pair.is_new || !obstacle.is_hard() || pair.distance.lower > obstacle.margin) continue;
    (pair.distance.lower > 0 ? tools.recovering : tools.overlapping) |= tools_of(pair);
  }
  return tools;
}

PairImpact PairProofs::ask(ProxyPair& pair, const BodyMotion& motion, WorkClock& clock,
                           TickStatistics& work) {
  ToiOptions options;
  options.target_distance = pair.target;
  options.distance_tolerance = pair.tolerance;
  const Obstacle& obstacle = *scene_.obstacles[pair.obstacle];
  PairImpact impact = obstacle.first_impact(motion, options, clock, pair.kept, memory_);
  work.impact_queries += impact.queries;
  work.node_pairs += impact.node_pairs;
  return impact;
}

// What a motion keeps, and the band above it in which impacts are found (toi/impact_band.h). A pair
// that slides loses an eighth of its slack in a motion, until rounding ends it. So each level keeps
// more than the promise, by half as much as the one before: a pair that has used up a level still
// has slack on the next, and none of them breaks the promise.
void PairProofs::set_band(ProxyPair& pair) const {
  const Scalar margin = scene_.obstacles[pair.obstacle]->margin;
  const Scalar part = std::ldexp(Scalar{1}, -pair.level);
  if (pair.eased_from > 0) {
    const Scalar above = pair.eased_from > margin ? pair.eased_from - margin : kInfinity;
    pair.tolerance = std::min({tolerance_, pair.eased_from / 4, above}) * (1 - part / 2);
    pair.target = pair.eased_from - pair.tolerance;
  } else {
    const Scalar raised = part * kRaisedShare * tolerance_;
    pair.target = margin + raised;
    pair.tolerance = tolerance_ - raised;
  }
}

// Sets the lowest level that keeps less than the distance.
bool PairProofs::has_band_below(ProxyPair& pair, Scalar distance) const {
  for (pair.level = 0; pair.level < kMostLevels; ++pair.level) {
    set_band(pair);
    if (pair.target + kGuaranteedFraction * pair.tolerance < distance) return true;
  }
  return false;
}

// A pair that is nearer than what is kept must come no nearer: not in a motion, and not little by
// little in many. The largest distance since it was first found there stays the measure, however
// loose later bounds are.
void PairProofs::choose_band(ProxyPair& pair, Scalar noise) const {
  const Scalar lower = pair.distance.lower;
  const Scalar eased_from = std::exchange(pair.eased_from, 0);
  pair.is_overlapping = !(lower > 0);
  if (pair.is_overlapping || has_band_below(pair, lower - kBandNoises * noise)) return;
  pair.eased_from = std::max(eased_from, lower);
  pair.is_overlapping = !has_band_below(pair, lower - kBandNoises * noise);
}

// Where the query found the pair below its band, or it is being left: in a band for where it is.
PairImpact PairProofs::ask_again(const ToolPoses& from, ProxyPair& pair, const BodyMotion& motion,
                                 Scalar noise, WorkClock& clock, TickStatistics& work) {
  PairImpact impact;
  WorkShare all(clock);
  measure(from, pair, {}, all, work);
  if (clock.cutoff()) return impact;
  choose_band(pair, noise);
  while (!pair.is_overlapping) {
    impact = ask(pair, motion, clock, work);
    // Too near for rounding to decide.
    const bool is_vague = impact.status == ToiStatus::InitiallyWithinTarget ||
                          (impact.status == ToiStatus::NumericalLimit && !(impact.t_safe > 0));
    if (!is_vague || clock.cutoff()) break;
    pair.is_overlapping = ++pair.level >= kMostLevels;
    set_band(pair);
  }
  return impact;
}

// Whether the distance alone tells that the pair stays apart.
bool PairProofs::is_far(const ProxyPair& pair, Scalar moved, Scalar noise) const {
  const Scalar margin = scene_.obstacles[pair.obstacle]->margin;
  const Scalar lower = pair.distance.lower;
  return (moved == 0 && lower > margin) || lower - moved - noise > margin + tolerance_;
}

void PairProofs::take_as_far(ProxyPair& pair) {
  pair.eased_from = 0;
  pair.level = 0;
  pair.is_overlapping = false;
  pair.is_new = false;
}

// The motion is free until the pair's impact, or as far as that was looked for.
void PairProofs::end_at(const PairImpact& impact, const ProxyPair& pair,
                        const std::optional<std::size_t>& other, Proof& proof) {
  proof.t_safe = impact.t_safe;
  proof.is_undecided = impact.status != ToiStatus::Impact;
  proof.has_hit = impact.has_hit;
  proof.hit = impact.hit;
  proof.hit.body = pair.body;
  proof.hit.obstacle = pair.obstacle;
  proof.hit.other = other;
}

// Every pair of a body and a hard obstacle is proven apart by a bound of how far both can move, by
// a query, or because neither moves; or it crosses and is reported.
Proof PairProofs::prove(const ToolPoses& from, const ToolMotions& motion, Scalar duration,
                        WorkClock& clock, TickStatistics& work) {
  Proof proof;
  proof.t_safe = duration;
  for (ProxyPair& pair : pairs_) {
    const Obstacle& obstacle = *scene_.obstacles[pair.obstacle];
    if (!obstacle.is_hard()) continue;
    const ToolBody& body = scene_.bodies[pair.body];
    const Scalar moved = motion.largest_displacement(body, proof.t_safe) +
                         moved_by_obstacle(pair, motion, proof.t_safe);
    const Scalar noise = kStepNoise * size_of(from, pair, moved);
    if (is_far(pair, moved, noise)) {
      take_as_far(pair);
      continue;
    }
    const auto other = scene_.body_of(pair.obstacle);
    const BodyMotion asked{body, motion.of(body), proof.t_safe, moved + noise,
                           other ? &motion.of(scene_.bodies[*other]) : nullptr};
    PairImpact impact;
    impact.status = ToiStatus::InitiallyWithinTarget;
    if (!(pair.eased_from > 0)) {
      set_band(pair);
      impact = ask(pair, asked, clock, work);
    }
    if (impact.status == ToiStatus::InitiallyWithinTarget) {
      impact = ask_again(from, pair, asked, noise, clock, work);
      if (clock.cutoff() && impact.status == ToiStatus::NotRun) {
        Proof cut_off;
        cut_off.recovering = tools_of(pair);
        cut_off.overlapping = proof.overlapping;
        return cut_off;
      }
      if (pair.eased_from > 0 || pair.is_overlapping) proof.recovering |= tools_of(pair);
      if (pair.is_overlapping) {
        pair.is_new = false;
        proof.overlapping |= tools_of(pair);
        pair.eased_from = 0;
        pair.level = 0;
        pair.proven = 0;
        continue;
      }
    }
    // A query that was cut off before it looked says nothing about what was found earlier.
    if (impact.t_safe > 0 || impact.status == ToiStatus::Impact) {
      pair.is_overlapping = false;
      pair.is_new = false;
    }
    // See ToiStatus.
    const Scalar kept = pair.target + pair.tolerance / 4 - 2 * noise;
    if (impact.t_safe > 0) pair.proven = std::min(pair.proven, kept);
    if (impact.status == ToiStatus::Separated) continue;
    end_at(impact, pair, other, proof);
    if (!(proof.t_safe > 0)) break;
  }
  return proof;
}

ToolSet PairProofs::tools_of(const ProxyPair& pair) const {
  ToolSet tools;
  tools.set(scene_.bodies[pair.body].tool);
  if (const auto other = scene_.body_of(pair.obstacle)) tools.set(scene_.bodies[*other].tool);
  return tools;
}

// Bound of how far any point of the obstacle moves until t.
Scalar PairProofs::moved_by_obstacle(const ProxyPair& pair, const ToolMotions& motion,
                                     Scalar t) const {
  if (const auto other = scene_.body_of(pair.obstacle)) {
    return motion.largest_displacement(scene_.bodies[*other], t);
  }
  return scene_.obstacles[pair.obstacle]->speed() * t * (1 + 8 * kUnitRoundoff);
}

// The largest coordinate that is rounded in a motion of the pair.
Scalar PairProofs::size_of(const ToolPoses& from, const ProxyPair& pair, Scalar moved) const {
  const auto size = [&](const ToolBody& body) {
    return from[body.tool].X_WT.translation().norm() + moved + body.shape->bounding_radius();
  };
  const Scalar of_body = size(scene_.bodies[pair.body]);
  const auto other = scene_.body_of(pair.obstacle);
  return other ? of_body + size(scene_.bodies[*other]) : of_body;
}

// Both bounds hold, whatever was found.
void PairProofs::take(const PairDistance& found, ProxyPair& pair) {
  const Scalar lower = std::max(pair.distance.lower, found.lower);
  if (found.upper < pair.distance.upper) pair.distance = found;
  pair.distance.lower = lower;
}

void PairProofs::measure(const ToolPoses& poses, ProxyPair& pair, const DistanceWish& wish,
                         WorkShare& share, TickStatistics& work) {
  ++work.distance_queries;
  take(scene_.obstacles[pair.obstacle]->measure(
           scene_.bodies[pair.body], scene_.body_pose(poses, pair.body), wish, share, pair.kept),
       pair);
}

// The clearance is that of the tool's nearest body: others only have to be proven farther away.
// Relative to the lower bound the upper one may exceed it by the tolerance.
DistanceWish PairProofs::wish_for(std::size_t tool, std::size_t obstacle) const {
  Scalar upper = kInfinity;
  for (std::size_t k = scene_.first_body[tool]; k < scene_.first_body[tool + 1]; ++k) {
    upper = std::min(upper, pair(k, obstacle).distance.upper);
  }
  const Scalar free = std::min(upper, std::abs(upper - scene_.obstacles[obstacle]->margin));
  const Scalar tolerance = scene_.options.clearance_tolerance;
  const Scalar allowed = (upper < kInfinity ? tolerance / (1 + tolerance) * free : 0) +
                         kVagueShare * scene_.options.rest_offset;
  return {upper, allowed, kMeasuredShare * allowed};
}

// How many times farther than allowed the pair's lower bound is below the clearance's upper one.
Scalar PairProofs::excess(const ProxyPair& pair, const DistanceWish& wish) {
  return (wish.farthest - pair.distance.lower) / wish.allowed;
}

// The pairs first whose bounds are the worst for what is allowed; those that are left when the
// share is used up are the worst in the next tick.
void PairProofs::measure(const ToolPoses& poses, WorkShare share, TickStatistics& work) {
  if (share.clock.cutoff()) return;
  loose_.clear();
  for (std::size_t tool = 0; tool < scene_.tools.size(); ++tool) {
    for (std::size_t obstacle = 0; obstacle < scene_.obstacles_of(tool); ++obstacle) {
      refresh(poses, tool, obstacle);
      const DistanceWish wish = wish_for(tool, obstacle);
      for (std::size_t body = scene_.first_body[tool]; body < scene_.first_body[tool + 1]; ++body) {
        const Scalar times = excess(pair(body, obstacle), wish);
        if (times > 1) loose_.push_back({times, first_pair_[body] + obstacle});
      }
    }
  }
  std::sort(loose_.begin(), loose_.end(), [](const Loose& x, const Loose& y) {
    return x.excess != y.excess ? x.excess > y.excess : x.pair < y.pair;
  });
  for (const Loose& loose : loose_) {
    if (share.is_over()) return;
    ProxyPair& pair = pairs_[loose.pair];
    const DistanceWish wish = wish_for(scene_.bodies[pair.body].tool, pair.obstacle);
    if (excess(pair, wish) > 1) measure(poses, pair, wish, share, work);
  }
}

// Re-measure the last nearest points first; often that tightens the bounds enough.
void PairProofs::refresh(const ToolPoses& poses, std::size_t tool, std::size_t obstacle) {
  const DistanceWish wish = wish_for(tool, obstacle);
  for (std::size_t body = scene_.first_body[tool]; body < scene_.first_body[tool + 1]; ++body) {
    ProxyPair& pair = pairs_[first_pair_[body] + obstacle];
    if (!(pair.distance.upper <= wish.farthest) || !(excess(pair, wish) > 1)) continue;
    take(scene_.obstacles[obstacle]->measure_again(scene_.bodies[pair.body],
                                                   scene_.body_pose(poses, pair.body), pair.kept),
         pair);
  }
}

// Distances are those measured before, minus the displacement since; or what the proof says, if
// that is more.
void PairProofs::commit(const ToolPoses& from, const ToolMotions& motion, Scalar t) {
  for (ProxyPair& pair : pairs_) {
    const ToolBody& body = scene_.bodies[pair.body];
    const Scalar of_obstacle = moved_by_obstacle(pair, motion, t);
    const Scalar moved = motion.largest_displacement(body, t) + of_obstacle;
    const Scalar vaguer = moved > 0 ? moved + kStepNoise * size_of(from, pair, moved) : 0;
    const Scalar proven = pair.proven < kInfinity ? pair.proven : 0;
    pair.distance.lower = std::max({Scalar{0}, pair.distance.lower - vaguer, proven});
    pair.distance.upper += vaguer;
    if (!(vaguer > 0)) continue;
    const auto [shift_W, turned] = motion.shift(body, t);
    const PairFront::Displacement displacement{vaguer, shift_W,
                                               turned + of_obstacle + (vaguer - moved)};
    for (PieceMemory& kept : pair.kept) kept.front.move(displacement);
  }
}

}  // namespace dyop::haptics_internal
