// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/proxy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tolerance.h"
#include "haptics/deforming_obstacle.h"

namespace dyop::haptics_internal {
namespace {

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

LoopScene::LoopScene(const HapticScene& scene, const HapticOptions& given)
    : options(given),
      hinges(scene.hinges),
      trocar(scene.trocar),
      bodies(make_tool_bodies(scene, has_deforming(scene))) {
  for (const ToolObstacle& obstacle : scene.obstacles) {
    obstacles.push_back(make_obstacle(obstacle));
  }
}

Proxy::Proxy(const HapticScene& scene, const HapticOptions& options)
    : scene_(scene, options), proofs_(scene_), contacts_(scene_) {
  course_.pose = start_pose(scene);
}

void Proxy::reset(const ToolPose& pose) {
  for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) forget(k);
  contacts_.forget_all();
  Course at_rest;
  at_rest.pose = pose;
  course_ = at_rest;
  last_goal_.reset();
  stuck_ticks_ = 0;
  was_escape_cut_ = false;
}

// --- a tick -------------------------------------------------------------------------------------

FollowReport Proxy::follow(const std::optional<ToolPose>& goal, Scalar dt, WorkClock& clock,
                           TickStatistics& work) {
  Following tick{goal.value_or(course_.pose), goal.has_value(), dt, clock, work};
  start(tick);
  const bool stands = tick.is_pulled && stuck_ticks_ >= kStuckTicks && tick.has_time();
  if (stands) move_among_standing(tick);
  if (stands || !tick.is_pulled) wait(tick);
  // Without a pull only what tissue pushes away.
  if (!stands) move_in_rounds(tick);
  wait(tick);
  finish(stands, tick);
  return tick.report;
}

bool Proxy::Following::has_time() const {
  return dt - report.committed > kTickNoise * dt;
}

void Proxy::start(const Following& tick) {
  for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) {
    if (scene_.obstacles[k]->start_tick()) forget(k);
  }
  path_.clear();
  path_.push_back({0, course_.pose});
  impulses_.clear();
  look_for_escape(tick.clock, tick.work);
  course_.last_goal_step = course_.goal_step;
  course_.goal_step = step_between(last_goal_.value_or(course_.pose), tick.goal);
  last_goal_ = tick.goal;
}

// Motions until the tick's time is over, or as many rounds as the options allow have ended early.
void Proxy::move_in_rounds(Following& tick) {
  for (int rounds = 0; tick.has_time() && rounds < scene_.options.max_rounds;) {
    const Piece piece = next_piece(tick);
    const Scalar done = move(tick.goal, piece, tick);
    tick.report.committed += done;
    if (tick.is_pulled) add_impulses(done);
    if (done >= piece.duration) continue;
    ++rounds;
    if (!(done > 0) || tick.clock.cutoff()) break;
    if (tick.is_short) wait(tick);
  }
}

// Where tissue closes in faster than the tool can leave, or proofs take longer than there is time,
// neither moves, and the next tick would begin with the same problem. While tissue stands the tool
// can at least stay where it is, and go wherever nothing is in its way.
void Proxy::move_among_standing(Following& tick) {
  for (const auto& obstacle : scene_.obstacles) obstacle->stand(true);
  move(tick.goal, {tick.dt, tick.dt, true}, tick);
  for (const auto& obstacle : scene_.obstacles) obstacle->stand(false);
  for (ToolWaypoint& waypoint : path_) waypoint.time = 0;
}

// The tool waits while tissue goes on, as far as that is proven.
void Proxy::wait(Following& tick) {
  while (tick.has_time()) {
    const Piece piece = next_piece(tick);
    const Scalar done = stay(piece.duration, tick);
    tick.report.committed += done;
    if (tick.is_pulled) add_impulses(done);
    if (done < piece.duration) break;
  }
}

void Proxy::finish(bool was_standing, Following& tick) {
  if (tick.is_pulled) add_impulses(tick.dt - tick.report.committed);
  course_.last_tick_step = step_between(path_.front().tool, course_.pose);
  const bool has_moved = tick.report.committed > 0 || tick.work.pieces > 0;
  if (was_standing) {
    stuck_ticks_ = kStuckTicks - 1;
  } else if (tick.is_pulled && tick.dt > 0) {
    stuck_ticks_ = has_moved ? 0 : std::min(stuck_ticks_ + 1, kStuckTicks);
  }
  for (const auto& obstacle : scene_.obstacles) obstacle->end_tick();
  tick.report.is_at_goal = is_at(tick.goal);
  // As they were left, also where a tick was cut off before it came to the pair.
  tick.report.was_overlapping |=
      std::any_of(proofs_.pairs().begin(), proofs_.pairs().end(),
                  [](const ProxyPair& pair) { return pair.is_overlapping; });
  // Once stuck, only ticks in which tissue stands set the pace.
  if (was_standing || stuck_ticks_ < kStuckTicks) {
    take_pace(tick.clock.cutoff().has_value(), tick.work.pieces > 0);
  }
}

// Until the next obstacle ends its motion; those that have ended theirs start the next.
Proxy::Piece Proxy::next_piece(const Following& tick) {
  Piece piece{0, tick.dt - tick.report.committed};
  piece.duration = piece.remaining;
  for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) {
    Obstacle& obstacle = *scene_.obstacles[k];
    if (!(obstacle.time_left() > 0) && obstacle.go_on()) forget(k);
    piece.duration = std::min(piece.duration, obstacle.time_left());
  }
  return piece;
}

// The obstacle is another mesh now.
void Proxy::forget(std::size_t obstacle) {
  for (std::size_t k = 0; k < proofs_.pairs().size(); ++k) {
    if (proofs_.pairs()[k].obstacle == obstacle && escape_.is_for(k)) escape_.stop();
  }
  proofs_.forget(obstacle);
  contacts_.forget(obstacle);
}

bool Proxy::is_at(const ToolPose& goal) const {
  const ToolStep step = step_between(course_.pose, goal);
  const Scalar near = kDefaultRelativeTolerance;
  Scalar turn = step.w_W.norm();
  for (std::size_t k = 0; k < scene_.hinges.size(); ++k) {
    turn = std::max(turn, std::abs(step.angles[k]));
  }
  return step.v_W.norm() <= scene_.options.rest_offset * near && turn <= near;
}

// Otherwise a device far ahead would request ever larger steps, none provable within one tick.
void Proxy::take_pace(bool was_cut, bool has_moved) {
  Scalar& pace = course_.pace;
  if (!was_cut) pace = std::min(Scalar{1}, 2 * pace);
  if (was_cut && !has_moved && !contacts_.was_hasty()) pace = std::max(kLeastPace, pace / 2);
}

// --- a motion -----------------------------------------------------------------------------------

// @return The time until which it was made.
Scalar Proxy::move(const ToolPose& goal, const Piece& piece, Following& tick) {
  const Plan planned = plan(goal, piece);
  contacts_.gather(course_, planned.wish, piece.duration, proofs_, tick.clock);
  if (tick.clock.cutoff()) return 0;
  if (piece.is_standing) contacts_.release();
  StepGoal step_goal;
  step_goal.from = course_.pose;
  step_goal.wish = planned.wish;
  step_goal.duration = piece.duration;
  step_goal.rest_gap = scene_.options.rest_offset;
  step_goal.recovery = piece.is_standing ? 0 : scene_.options.recovery_speed * piece.duration;
  step_goal.tolerance = kSolveShare * scene_.options.rest_offset;
  goal_part_ = planned.part;
  const Motion motion = find_motion(step_goal, tick);
  if (!(motion.t_safe > 0)) return 0;
  commit(ToolMotion(course_.pose, motion.step, piece.duration, scene_.hinges), motion.t_safe);
  ++tick.work.pieces;
  return motion.t_safe;
}

// To the device at the pace that is kept; or out of what the tool overlaps.
Proxy::Plan Proxy::plan(const ToolPose& goal, const Piece& piece) const {
  if (const auto out_W = escape_.direction()) {
    Plan plan{{}, 1};
    plan.wish.v_W = scene_.options.recovery_speed * piece.duration * *out_W;
    return plan;
  }
  const ToolStep whole = step_between(course_.pose, goal);
  Scalar part = course_.pace * piece.duration / piece.remaining;
  part = std::min(part, contacts_.trocar_part(course_.pose, whole));
  return {scaled(whole, part), part};
}

// Solves and proves by turns until a step is free as far as it is tried; of all that were tried the
// one that came farthest.
Proxy::Motion Proxy::find_motion(const StepGoal& goal, Following& tick) {
  Motion best;
  proofs_.start_motion();
  tick.report.is_held = false;
  ToolStep step = goal.wish;
  for (int attempt = 0; attempt < scene_.options.max_attempts; ++attempt) {
    if (tick.clock.is_over()) break;
    const bool is_held = contacts_.can_hold();
    if (is_held) step = contacts_.solve(course_, goal, tick.clock, tick.work);
    if (tick.clock.cutoff()) break;
    const ToolMotion motion(course_.pose, step, goal.duration, scene_.hinges);
    const Scalar horizon = contacts_.horizon_of(course_, step, goal.duration);
    const Proof proof = prove(motion, horizon, tick);
    if (proof.t_safe > best.t_safe) {
      best = {step, proof.t_safe};
      tick.report.is_held = proof.t_safe >= goal.duration && is_held;
      tick.is_short = horizon < goal.duration;
    }
    if (proof.t_safe >= horizon || proof.is_undecided || !proof.has_hit) break;
    // More demands would not help.
    if (!(proof.t_safe > 0) && contacts_.is_contradiction()) break;
    if (attempt + 1 < scene_.options.max_attempts) contacts_.add_hit(proof.hit);
  }
  return best;
}

Scalar Proxy::stay(Scalar duration, Following& tick) {
  proofs_.start_motion();
  const ToolMotion motion(course_.pose, {}, duration, scene_.hinges);
  const Proof proof = prove(motion, duration, tick);
  if (proof.t_safe > 0) commit(motion, proof.t_safe);
  return proof.t_safe;
}

Proof Proxy::prove(const ToolMotion& motion, Scalar duration, Following& tick) {
  const Proof proof = proofs_.prove(course_.pose, motion, duration, tick.clock, tick.work);
  tick.report.was_recovering |= proof.was_recovering;
  tick.report.was_overlapping |= proof.was_overlapping;
  return proof;
}

void Proxy::commit(const ToolMotion& motion, Scalar t) {
  proofs_.commit(course_.pose, motion, t);
  const ToolPose before = std::exchange(course_.pose, motion.at(t));
  course_.last_step = step_between(before, course_.pose);
  course_.rate_before = std::exchange(course_.rate, scaled(course_.last_step, 1 / t));
  path_.push_back({path_.back().time + t, course_.pose});
  contacts_.pass(t);
  for (const auto& obstacle : scene_.obstacles) obstacle->pass(t);
}

// For so long the forces of the last solve act.
void Proxy::add_impulses(Scalar time) {
  if (!(time > 0)) return;
  for (const HoldPoint& hold : contacts_.holds()) {
    if (hold.impulse_W.isZero(0)) continue;
    impulses_.push_back({hold.obstacle, hold.p_WA, hold.surface, time * force_W(hold)});
  }
}

// --- a way out ----------------------------------------------------------------------------------

// Search an exit for the first overlapping pair; restart after failure because tissue moves; skip
// every other tick if it was cut off, so that time is left to move.
void Proxy::look_for_escape(WorkClock& clock, TickStatistics& work) {
  std::vector<ProxyPair>& pairs = proofs_.pairs();
  const auto crossing = std::find_if(pairs.begin(), pairs.end(),
                                     [](const ProxyPair& pair) { return pair.is_overlapping; });
  if (crossing == pairs.end()) return escape_.stop();
  if (std::exchange(was_escape_cut_, false)) return;
  const ToolBody& body = scene_.bodies[crossing->body];
  const auto number = std::size_t(crossing - pairs.begin());
  if (!escape_.is_for(number) || escape_.has_failed()) {
    escape_.start(number, body.thickness / kEscapeStart);
  }
  const Obstacle& obstacle = *scene_.obstacles[crossing->obstacle];
  const RigidPose X_WB = scene_.body_pose(course_.pose, crossing->body);
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

void Escape::start(std::size_t pair, Scalar first_length) {
  *this = {};
  pair_ = pair;
  first_length_ = length_ = first_length;
}

// The neighbours of the centre cell of a 3 x 3 x 3 cube: all but number 13.
Vector3 Escape::direction_of(int number) {
  const int cell = number < kDirections / 2 ? number : number + 1;
  return Vector3(cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1).normalized();
}

std::optional<Vector3> Escape::direction() const {
  if (!pair_ || !is_through() || has_failed()) return std::nullopt;
  return direction_of(best_);
}

}  // namespace dyop::haptics_internal
