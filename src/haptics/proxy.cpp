// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/proxy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tolerance.h"
#include "haptics/deforming_obstacle.h"

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

// Tolerance of the solve as a fraction of the rest offset.
constexpr Scalar kSolveShare = 1e-2;

// The first positions tried by an escape are this fraction of a body's thickness away; so many
// are tried in a tick.
constexpr Scalar kEscapeStart = 8;
constexpr int kEscapesTried = 4;

// If a tick is cut off before the tool moves, the next one tries half the step, down to this
// fraction.
constexpr Scalar kLeastPace = 0x1p-12;

// After so many ticks in which nothing moved, the next one and then every other one lets tissue
// stand. Of ticks that a deadline cuts off a few may be stuck and the next come through.
constexpr int kStuckTicks = 4;

// Node pairs that a query may hold for one time interval without growing its memory.
constexpr std::size_t kQueuedPairs = 512;

// So many pairs to ask about, and holds before they are thinned out, need no further memory.
constexpr std::size_t kReservedPairs = 4096;
constexpr std::size_t kReservedHolds = 1024;

// A time shorter than this fraction of a tick is not worth its own motion.
constexpr Scalar kTickNoise = 0x1p-30;

std::unique_ptr<Obstacle> make_obstacle(const ToolObstacle& given) {
  std::unique_ptr<Obstacle> obstacle;
  if (given.shape) {
    obstacle = make_rigid_obstacle(given);
  } else {
    obstacle = std::make_unique<DeformingObstacle>(given.vertices, given.triangles);
  }
  obstacle->name = given.name;
  obstacle->role = given.role;
  obstacle->margin = given.margin;
  obstacle->friction = given.role == ObstacleRole::Tissue ? given.friction : 0;
  obstacle->soft_stiffness = given.soft_stiffness;
  return obstacle;
}

bool has_deforming(const HapticScene& scene) {
  return std::any_of(scene.obstacles.begin(), scene.obstacles.end(),
                     [](const ToolObstacle& obstacle) { return !obstacle.shape; });
}

ToolPose start_pose(const HapticScene& scene) {
  ToolPose pose{scene.X_WT, {}};
  for (std::size_t k = 0; k < scene.hinges.size(); ++k) pose.angles[k] = scene.hinges[k].angle;
  return pose;
}

}  // namespace

Proxy::Proxy(const HapticScene& scene, const HapticOptions& options)
    : options_(options),
      tolerance_(kToleranceShare * options.rest_offset),
      hinges_(scene.hinges),
      bodies_(make_tool_bodies(scene, has_deforming(scene))),
      solver_(options.coupling, scene.hinges, bodies_, std::size_t(options.max_contacts)),
      pose_(start_pose(scene)) {
  memory_.workspace.reserve(kQueuedPairs);
  memory_.pairs.reserve(kReservedPairs);
  found_.reserve(kReservedHolds);
  for (const ToolObstacle& obstacle : scene.obstacles) {
    obstacles_.push_back(make_obstacle(obstacle));
  }
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    for (std::size_t obstacle = 0; obstacle < obstacles_.size(); ++obstacle) {
      ProxyPair& pair = pairs_.emplace_back();
      pair.body = body;
      pair.obstacle = obstacle;
      if (obstacles_[obstacle]->is_hard()) obstacles_[obstacle]->prepare(bodies_[body], memory_);
    }
  }
  loose_.reserve(pairs_.size());
}

// --- following
// ------------------------------------------------------------------------------------

// The obstacle is another mesh now.
void Proxy::forget(std::size_t obstacle) {
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    ProxyPair& pair = pairs_[k];
    if (pair.obstacle != obstacle) continue;
    pair.distance = {};
    pair.is_overlapping = false;
    pair.eased_from = 0;
    pair.level = 0;
    for (PieceMemory& kept : pair.kept) kept.restart();
    if (escape_.is_for(k)) escape_.stop();
  }
  std::erase_if(holds_, [&](const HoldPoint& hold) { return hold.obstacle == obstacle; });
}

Scalar Proxy::piece_time(Scalar remaining) const {
  Scalar time = remaining;
  for (const auto& obstacle : obstacles_) time = std::min(time, obstacle->time_left());
  return time;
}

bool Proxy::is_at(const ToolPose& goal) const {
  const ToolStep step = step_between(pose_, goal);
  const Scalar near = kDefaultRelativeTolerance;
  Scalar turn = step.w_W.norm();
  for (std::size_t k = 0; k < hinges_.size(); ++k) turn = std::max(turn, std::abs(step.angles[k]));
  return step.v_W.norm() <= options_.rest_offset * near && turn <= near;
}

FollowReport Proxy::follow(const std::optional<ToolPose>& goal, Scalar dt, WorkClock& clock,
                           TickStatistics& work) {
  FollowReport report;
  for (std::size_t k = 0; k < obstacles_.size(); ++k) {
    if (obstacles_[k]->start_tick()) forget(k);
  }
  path_.clear();
  path_.push_back({0, pose_});
  is_short_ = false;
  const auto has_time = [&] { return dt - report.committed > kTickNoise * dt; };
  const auto next_piece = [&] {
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
      if (!(obstacles_[k]->time_left() > 0) && obstacles_[k]->go_on()) forget(k);
    }
    const Scalar remaining = dt - report.committed;
    return Piece{piece_time(remaining), remaining};
  };
  const auto wait = [&] {
    while (has_time()) {
      const Piece piece = next_piece();
      const Scalar done = stay(piece.duration, clock, work, report);
      report.committed += done;
      if (done < piece.duration) break;
    }
  };
  look_for_escape(clock, work);
  const ToolPose wished = goal.value_or(pose_);
  last_goal_step_ = goal_step_;
  goal_step_ = step_between(last_goal_.value_or(pose_), wished);
  last_goal_ = wished;
  const bool stands = goal && stuck_ticks_ >= kStuckTicks && has_time();
  if (stands) move_among_standing(wished, dt, clock, work, report);
  if (!goal || stands) wait();
  for (int rounds = 0; !stands && has_time() && rounds < options_.max_rounds;) {
    const Piece piece = next_piece();
    const Scalar done = move(wished, piece, clock, work, report);
    report.committed += done;
    if (done >= piece.duration) continue;
    ++rounds;
    if (!(done > 0) || clock.cutoff()) break;
    if (is_short_) wait();
  }
  wait();
  last_tick_step_ = step_between(path_.front().tool, pose_);
  const bool has_moved = report.committed > 0 || work.pieces > 0;
  if (stands) {
    stuck_ticks_ = kStuckTicks - 1;
  } else if (goal && dt > 0) {
    stuck_ticks_ = has_moved ? 0 : std::min(stuck_ticks_ + 1, kStuckTicks);
  }
  report.is_at_goal = is_at(wished);
  // As they were left, also where a tick was cut off before it came to the pair.
  report.was_overlapping |= std::any_of(pairs_.begin(), pairs_.end(),
                                        [](const ProxyPair& pair) { return pair.is_overlapping; });
  // Of the ticks in which tissue does not stand nothing is expected then.
  if (stands || stuck_ticks_ < kStuckTicks) {
    take_pace(clock.cutoff().has_value(), work.pieces > 0);
  }
  return report;
}

// Where tissue closes in faster than the tool can leave, or proofs take longer than there is time,
// neither moves, and the next tick would begin with the same problem. While tissue stands the tool
// can at least stay where it is, and go wherever nothing is in its way.
void Proxy::move_among_standing(const ToolPose& goal, Scalar duration, WorkClock& clock,
                                TickStatistics& work, FollowReport& report) {
  for (const auto& obstacle : obstacles_) obstacle->stand(true);
  move(goal, {duration, duration, true}, clock, work, report);
  for (const auto& obstacle : obstacles_) obstacle->stand(false);
  for (ToolWaypoint& waypoint : path_) waypoint.time = 0;
}

// Otherwise a device far ahead would request ever larger steps, none provable within one tick.
void Proxy::take_pace(bool was_cut, bool has_moved) {
  if (!was_cut) pace_ = std::min(Scalar{1}, 2 * pace_);
  if (was_cut && !has_moved && !was_hasty_) pace_ = std::max(kLeastPace, pace_ / 2);
}

Scalar Proxy::move(const ToolPose& goal, const Piece& piece, WorkClock& clock, TickStatistics& work,
                   FollowReport& report) {
  ToolStep wish = scaled(step_between(pose_, goal), pace_ * piece.duration / piece.remaining);
  if (const auto out_W = escape_.direction()) {
    wish = {};
    wish.v_W = options_.recovery_speed * piece.duration * *out_W;
  }
  gather_holds(wish, piece, clock);
  if (clock.cutoff()) return 0;
  if (piece.is_standing) release_holds();
  const StepGoal step_goal{pose_,
                           wish,
                           piece.duration,
                           options_.rest_offset,
                           piece.is_standing ? 0 : options_.recovery_speed * piece.duration,
                           kSolveShare * options_.rest_offset};
  for (ProxyPair& pair : pairs_) pair.proven = kInfinity;
  report.is_held = false;
  ToolStep step = wish;
  ToolStep best_step;
  Scalar best = 0;
  for (int attempt = 0; attempt < options_.max_attempts; ++attempt) {
    if (clock.is_over()) break;
    if (!holds_.empty()) step = solve(step_goal, clock, work);
    if (clock.cutoff()) break;
    const ToolMotion motion(pose_, step, piece.duration, hinges_);
    const Scalar horizon = horizon_of(step, piece.duration);
    const Proof proof = prove(motion, horizon, clock, work, report);
    if (proof.t_safe > best) {
      best = proof.t_safe;
      best_step = step;
      report.is_held = best >= piece.duration && !holds_.empty();
      is_short_ = horizon < piece.duration;
    }
    if (proof.t_safe >= horizon || proof.is_undecided || !proof.has_hit) break;
    // More demands would not help.
    if (!(proof.t_safe > 0) && solver_.is_contradiction()) break;
    if (attempt + 1 < options_.max_attempts) add_hit(proof.hit);
  }
  if (best > 0) {
    commit(ToolMotion(pose_, best_step, piece.duration, hinges_), best);
    ++work.pieces;
  }
  return best;
}

// Search an exit for the first overlapping pair; restart after failure because tissue moves; skip
// every other tick if it was cut off, so that time is left to move.
void Proxy::look_for_escape(WorkClock& clock, TickStatistics& work) {
  const auto crossing = std::find_if(pairs_.begin(), pairs_.end(),
                                     [](const ProxyPair& pair) { return pair.is_overlapping; });
  if (crossing == pairs_.end()) return escape_.stop();
  if (std::exchange(was_escape_cut_, false)) return;
  const ToolBody& body = bodies_[crossing->body];
  const auto number = std::size_t(crossing - pairs_.begin());
  if (!escape_.is_for(number) || escape_.has_failed()) {
    escape_.start(number, body.thickness / kEscapeStart);
  }
  const Obstacle& obstacle = *obstacles_[crossing->obstacle];
  const RigidPose X_WB = body_pose(crossing->body);
  for (int k = 0; k < kEscapesTried && !clock.is_over(); ++k) {
    escape_.try_next([&](const Vector3& moved) {
      ++work.distance_queries;
      const RigidPose X_WB_there =
          RigidPose::from_trusted(X_WB.rotation(), X_WB.translation() + moved);
      return obstacle.is_apart_at(body, X_WB_there, clock, crossing->kept);
    });
  }
  was_escape_cut_ = clock.cutoff().has_value();
}

// Tissue moves on, the tool waits.
Scalar Proxy::stay(Scalar duration, WorkClock& clock, TickStatistics& work, FollowReport& report) {
  for (ProxyPair& pair : pairs_) pair.proven = kInfinity;
  const ToolMotion motion(pose_, {}, duration, hinges_);
  const Proof proof = prove(motion, duration, clock, work, report);
  if (proof.t_safe > 0) commit(motion, proof.t_safe);
  return proof.t_safe;
}

// Distances are those measured before, minus the displacement since; or what the proof says, if
// that is more.
void Proxy::commit(const ToolMotion& motion, Scalar t) {
  for (ProxyPair& pair : pairs_) {
    const ToolBody& body = bodies_[pair.body];
    const Scalar of_tissue = t * obstacles_[pair.obstacle]->speed() * (1 + 8 * kUnitRoundoff);
    const Scalar moved = motion.largest_displacement(body, t) + of_tissue;
    const Scalar size = pose_.X_WT.translation().norm() + moved + body.shape->bounding_radius();
    const Scalar vaguer = moved > 0 ? moved + kStepNoise * size : 0;
    const Scalar proven = pair.proven < kInfinity ? pair.proven : 0;
    pair.distance.lower = std::max({Scalar{0}, pair.distance.lower - vaguer, proven});
    pair.distance.upper += vaguer;
    if (!(vaguer > 0)) continue;
    const auto [shift_W, turned] = motion.shift(body, t);
    const PairFront::Displacement displacement{vaguer, shift_W,
                                               turned + of_tissue + (vaguer - moved)};
    for (PieceMemory& kept : pair.kept) kept.front.move(displacement);
  }
  const ToolPose before = pose_;
  pose_ = motion.at(t);
  last_step_ = step_between(before, pose_);
  rate_before_ = rate_;
  rate_ = scaled(last_step_, 1 / t);
  path_.push_back({path_.back().time + t, pose_});
  holds_since_ += t;
  for (const auto& obstacle : obstacles_) obstacle->pass(t);
}

// --- proof
// ----------------------------------------------------------------------------------------

PairImpact Proxy::ask(ProxyPair& pair, const BodyMotion& motion, WorkClock& clock,
                      TickStatistics& work) {
  ToiOptions options;
  options.target_distance = pair.target;
  options.distance_tolerance = pair.tolerance;
  const Obstacle& obstacle = *obstacles_[pair.obstacle];
  PairImpact impact = obstacle.first_impact(motion, options, clock, pair.kept, memory_);
  work.impact_queries += impact.queries;
  work.node_pairs += impact.node_pairs;
  return impact;
}

// What a motion keeps, and the band above it in which impacts are found (toi/impact_band.h). A pair
// that slides loses an eighth of its slack in a motion, until rounding ends it. So each level keeps
// more than the promise, by half as much as the one before: a pair that has used up a level still
// has slack on the next, and none of them breaks the promise.
void Proxy::set_band(ProxyPair& pair) const {
  const Scalar margin = obstacles_[pair.obstacle]->margin;
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
bool Proxy::has_band_below(ProxyPair& pair, Scalar distance) const {
  for (pair.level = 0; pair.level < kMostLevels; ++pair.level) {
    set_band(pair);
    if (pair.target + kGuaranteedFraction * pair.tolerance < distance) return true;
  }
  return false;
}

// A pair that is nearer than what is kept must come no nearer: not in a motion, and not little by
// little in many. The largest distance since it was first found there stays the measure, however
// loose later bounds are.
void Proxy::choose_band(ProxyPair& pair, Scalar noise) const {
  const Scalar lower = pair.distance.lower;
  const Scalar eased_from = std::exchange(pair.eased_from, 0);
  pair.is_overlapping = !(lower > 0);
  if (pair.is_overlapping || has_band_below(pair, lower - kBandNoises * noise)) return;
  pair.eased_from = std::max(eased_from, lower);
  pair.is_overlapping = !has_band_below(pair, lower - kBandNoises * noise);
}

// Where the query found the pair below its band, or it is being left: in a band for where it is.
PairImpact Proxy::ask_again(ProxyPair& pair, const BodyMotion& motion, Scalar noise,
                            WorkClock& clock, TickStatistics& work) {
  PairImpact impact;
  WorkShare all(clock);
  measure(pair, {}, all, work);
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

// Every pair of a body and a hard obstacle is proven apart by a bound of how far both can move, by
// a query, or because neither moves; or it crosses and is reported.
Proxy::Proof Proxy::prove(const ToolMotion& motion, Scalar duration, WorkClock& clock,
                          TickStatistics& work, FollowReport& report) {
  Proof proof;
  proof.t_safe = duration;
  for (ProxyPair& pair : pairs_) {
    const Obstacle& obstacle = *obstacles_[pair.obstacle];
    if (!obstacle.is_hard()) continue;
    const ToolBody& body = bodies_[pair.body];
    const Scalar moved = motion.largest_displacement(body, proof.t_safe) +
                         obstacle.speed() * proof.t_safe * (1 + 8 * kUnitRoundoff);
    const Scalar noise =
        kStepNoise * (pose_.X_WT.translation().norm() + moved + body.shape->bounding_radius());
    if ((moved == 0 && pair.distance.lower > obstacle.margin) ||
        pair.distance.lower - moved - noise > obstacle.margin + tolerance_) {
      pair.eased_from = 0;
      pair.level = 0;
      pair.is_overlapping = false;
      continue;
    }
    const BodyMotion asked{body, motion.of(body), proof.t_safe, moved + noise};
    PairImpact impact;
    impact.status = ToiStatus::InitiallyWithinTarget;
    if (!(pair.eased_from > 0)) {
      set_band(pair);
      impact = ask(pair, asked, clock, work);
    }
    if (impact.status == ToiStatus::InitiallyWithinTarget) {
      impact = ask_again(pair, asked, noise, clock, work);
      if (clock.cutoff() && impact.status == ToiStatus::NotRun) {
        report.was_recovering = true;
        return {};
      }
      report.was_recovering |= pair.eased_from > 0 || pair.is_overlapping;
      if (pair.is_overlapping) {
        report.was_overlapping = true;
        pair.eased_from = 0;
        pair.level = 0;
        pair.proven = 0;
        continue;
      }
    }
    // A query that was cut off before it looked says nothing about what was found earlier.
    if (impact.t_safe > 0 || impact.status == ToiStatus::Impact) pair.is_overlapping = false;
    // See ToiStatus.
    const Scalar kept = pair.target + pair.tolerance / 4 - 2 * noise;
    if (impact.t_safe > 0) pair.proven = std::min(pair.proven, kept);
    if (impact.status == ToiStatus::Separated) continue;
    proof.t_safe = impact.t_safe;
    proof.is_undecided = impact.status != ToiStatus::Impact;
    proof.has_hit = impact.has_hit;
    proof.hit = impact.hit;
    proof.hit.body = pair.body;
    proof.hit.obstacle = pair.obstacle;
    if (!(proof.t_safe > 0)) break;
  }
  return proof;
}

}  // namespace dyop::haptics_internal
