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

ToolPoses start_poses(std::span<const HapticTool> tools) {
  ToolPoses poses(tools.size());
  for (std::size_t k = 0; k < tools.size(); ++k) poses[k] = tools[k].start();
  return poses;
}

}  // namespace

LoopScene::LoopScene(const HapticScene& scene, const HapticOptions& given)
    : options(given), tools(scene.tools()) {
  for (std::size_t k = 0; k < tools.size(); ++k) {
    if (!tools[k].coupling) tools[k].coupling = given.coupling;
    first_body.push_back(bodies.size());
    for (ToolBody& body : make_tool_bodies(tools[k], k, has_deforming(scene))) {
      bodies.push_back(std::move(body));
    }
  }
  first_body.push_back(bodies.size());
  for (const ToolObstacle& obstacle : scene.obstacles) {
    obstacles.push_back(make_obstacle(obstacle));
  }
  scene_obstacles = obstacles.size();
  if (tools.size() == 1) return;
  for (const ToolBody& body : bodies) {
    ToolObstacle other;
    other.name = "tool";
    other.shape = body.shape;
    other.margin = scene.tool_margin;
    other.friction = scene.tool_friction;
    obstacles.push_back(make_obstacle(other));
  }
  place(start_poses(tools));
}

void LoopScene::place(const ToolPoses& poses) const {
  for (std::size_t k = scene_obstacles; k < obstacles.size(); ++k) {
    obstacles[k]->move_to(body_pose(poses, k - scene_obstacles));
  }
}

Proxy::Proxy(const HapticScene& scene, const HapticOptions& options)
    : scene_(scene, options),
      proofs_(scene_),
      contacts_(scene_, start_poses(scene_.tools)),
      course_(start_poses(scene_.tools)),
      goal_parts_(scene_.tools.size(), 1) {}

void Proxy::reset(std::size_t tool, const ToolPose& pose) {
  for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) forget(k);
  contacts_.forget_all();
  ToolPoses poses = course_.pose;
  poses[tool] = pose;
  course_ = Course(poses);
  scene_.place(poses);
  last_goal_.reset();
  stuck_ticks_ = 0;
  was_escape_cut_ = false;
}

// --- a tick -------------------------------------------------------------------------------------

FollowReport Proxy::follow(const PerTool<std::optional<ToolPose>>& goals, Scalar dt,
                           WorkClock& clock, TickStatistics& work) {
  Following tick{course_.pose, false, dt, clock, work};
  for (std::size_t k = 0; k < goals.size(); ++k) {
    if (!goals[k]) continue;
    tick.goal[k] = *goals[k];
    tick.is_pulled = true;
  }
  start(tick);
  const bool stands = tick.is_pulled && stuck_ticks_ >= kStuckTicks && tick.has_time();
  if (stands) move_among_standing(tick);
  if (stands || !tick.is_pulled) wait(tick);
  // Without a pull only what tissue pushes away.
  if (!stands) move_in_rounds(tick);
  wait(tick);
  if (tick.is_pulled && tick.ended_early) move_one_by_one(tick);
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
  proofs_.measure_new(course_.pose, tick.work);
  for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
    paths_[k].clear();
    paths_[k].push_back({0, course_.pose[k]});
    impulses_[k].clear();
  }
  path_progress_.clear();
  note_progress();
  look_for_escape(tick.clock, tick.work);
  course_.last_goal_step = course_.goal_step;
  course_.goal_step = step_between(last_goal_.value_or(course_.pose), tick.goal);
  last_goal_ = tick.goal;
}

// Motions until the tick's time is over, or as many rounds as the options allow have ended early.
void Proxy::move_in_rounds(Following& tick) {
  for (int rounds = 0; tick.has_time() && rounds < scene_.options.max_rounds;) {
    const Piece piece = next_piece(tick);
    const Scalar done = move(piece, tick);
    tick.report.committed += done;
    if (tick.is_pulled) add_impulses(done);
    if (done >= piece.duration) continue;
    tick.ended_early = true;
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
  move({tick.dt, tick.dt, true}, tick);
  for (const auto& obstacle : scene_.obstacles) obstacle->stand(false);
  for (auto& path : paths_) {
    for (ToolWaypoint& waypoint : path) waypoint.time = 0;
  }
}

// All tools move for the same time, so that one that is stopped short stops the others, too, though
// nothing may be in their way. While tissue and the other tools stand, each goes on by itself. What
// holds them is that of their common motion.
void Proxy::move_one_by_one(Following& tick) {
  const std::size_t tools = scene_.tools.size();
  if (tools == 1) return;
  contacts_.keep();
  const PerTool<Scalar> parts = goal_parts_;
  const std::size_t known = paths_[0].size();
  for (const auto& obstacle : scene_.obstacles) obstacle->stand(true);
  for (std::size_t k = 0; k < tools && !tick.clock.is_over(); ++k) {
    if (!is_at(k, tick.goal[k])) move({tick.dt, tick.dt, true, ToolSet().set(k)}, tick);
  }
  for (const auto& obstacle : scene_.obstacles) obstacle->stand(false);
  for (std::size_t k = 0; k < tools; ++k) {
    std::vector<ToolWaypoint>& path = paths_[k];
    for (std::size_t i = known; i < path.size(); ++i) path[i].time = path[known - 1].time;
  }
  contacts_.restore();
  goal_parts_ = parts;
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
  for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
    course_.last_tick_step[k] = step_between(paths_[k].front().tool, course_.pose[k]);
    tick.report.at_goal[k] = is_at(k, tick.goal[k]);
  }
  const bool has_moved = tick.report.committed > 0 || tick.work.pieces > 0;
  if (was_standing) {
    stuck_ticks_ = kStuckTicks - 1;
  } else if (tick.is_pulled && tick.dt > 0) {
    stuck_ticks_ = has_moved ? 0 : std::min(stuck_ticks_ + 1, kStuckTicks);
  }
  for (const auto& obstacle : scene_.obstacles) obstacle->end_tick();
  // Also where a tick was cut off before it came to the pair.
  if (tick.clock.cutoff()) {
    tick.report.recovering |= proofs_.measure_crossing(course_.pose, tick.work);
  }
  for (const ProxyPair& pair : proofs_.pairs()) {
    if (pair.is_overlapping) tick.report.overlapping |= proofs_.tools_of(pair);
  }
  // Once stuck, only ticks in which tissue stands set the pace.
  if (was_standing || stuck_ticks_ < kStuckTicks) {
    take_pace(tick.clock.cutoff().has_value(), tick.work.pieces > 0);
  }
  // The same search would take the same time from the proof, which has to begin again.
  const bool has_stayed = tick.clock.cutoff() && tick.work.pieces == 0;
  if (has_stayed && contacts_.has_searched()) contacts_.skip_next_search();
}

// Until the next obstacle ends its motion; those that have ended theirs start the next.
Proxy::Piece Proxy::next_piece(const Following& tick) {
  Piece piece{0, tick.dt - tick.report.committed};
  piece.duration = piece.remaining;
  for (std::size_t k = 0; k < scene_.obstacles.size(); ++k) {
    Obstacle& obstacle = *scene_.obstacles[k];
    if (!(obstacle.time_left() > 0) && obstacle.go_on()) {
      forget(k);
      proofs_.measure_new(course_.pose, tick.work);
    }
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

bool Proxy::is_at(std::size_t tool, const ToolPose& goal) const {
  const ToolStep step = step_between(course_.pose[tool], goal);
  const Scalar near = kDefaultRelativeTolerance;
  Scalar turn = step.w_W.norm();
  for (std::size_t k = 0; k < scene_.tools[tool].hinges.size(); ++k) {
    turn = std::max(turn, std::abs(step.angles[k]));
  }
  return step.v_W.norm() <= scene_.options.rest_offset * near && turn <= near;
}

// Otherwise a device far ahead would request ever larger steps, none provable within one tick.
void Proxy::take_pace(bool was_cut, bool has_moved) {
  Scalar& pace = course_.pace;
  if (!was_cut) pace = std::min(Scalar{1}, 2 * pace);
  // A tick that searched may have left too little time for its motion; the next one does not.
  if (was_cut && !has_moved && !contacts_.has_searched()) pace = std::max(kLeastPace, pace / 2);
}

// --- a motion -----------------------------------------------------------------------------------

// @return The time until which it was made.
Scalar Proxy::move(const Piece& piece, Following& tick) {
  const Plan planned = plan(tick.goal, piece);
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
  step_goal.moving = piece.moving;
  goal_parts_ = planned.part;
  const Motion motion = find_motion(step_goal, tick);
  if (!(motion.t_safe > 0)) return 0;
  commit(ToolMotions(course_.pose, motion.steps, piece.duration, scene_.tools), motion.t_safe,
         piece.moving);
  ++tick.work.pieces;
  return motion.t_safe;
}

// To the devices at the pace that is kept; or out of what a tool overlaps.
Proxy::Plan Proxy::plan(const ToolPoses& goal, const Piece& piece) const {
  ToolSteps whole = step_between(course_.pose, goal);
  const auto out_W = escape_.direction();
  const std::size_t leaving =
      out_W ? scene_.bodies[proofs_.pairs()[*escape_.pair()].body].tool : scene_.tools.size();
  if (out_W) whole[leaving] = {};
  for (std::size_t k = 0; k < whole.size(); ++k) {
    if (!piece.moving[k]) whole[k] = {};
  }
  Scalar part = course_.pace * piece.duration / piece.remaining;
  part = std::min(part, contacts_.linear_part(course_.pose, whole));
  Plan plan{scaled(whole, part), PerTool<Scalar>(scene_.tools.size(), part)};
  if (!out_W || !piece.moving[leaving]) return plan;
  plan.wish[leaving].v_W = scene_.options.recovery_speed * piece.duration * *out_W;
  plan.part[leaving] = 1;
  return plan;
}

// Solves and proves by turns until a step is free as far as it is tried; of all that were tried the
// one that came farthest.
Proxy::Motion Proxy::find_motion(const StepGoal& goal, Following& tick) {
  Motion best;
  proofs_.start_motion();
  tick.report.held &= ~goal.moving;
  ToolSteps steps = goal.wish;
  for (int attempt = 0; attempt < scene_.options.max_attempts; ++attempt) {
    if (tick.clock.is_over()) break;
    const bool is_held = contacts_.can_hold();
    if (is_held) steps = contacts_.solve(course_, goal, tick.clock, tick.work);
    if (tick.clock.cutoff()) break;
    const ToolMotions motion(course_.pose, steps, goal.duration, scene_.tools);
    const Scalar horizon = contacts_.horizon_of(course_, steps, goal.duration);
    const Proof proof = prove(motion, horizon, tick);
    if (proof.t_safe > best.t_safe) {
      best = {steps, proof.t_safe};
      if (proof.t_safe >= goal.duration && is_held) tick.report.held |= goal.moving;
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
  const ToolMotions motion(course_.pose, ToolSteps(scene_.tools.size()), duration, scene_.tools);
  const Proof proof = prove(motion, duration, tick);
  if (proof.t_safe > 0) commit(motion, proof.t_safe, all_tools());
  return proof.t_safe;
}

Proof Proxy::prove(const ToolMotions& motion, Scalar duration, Following& tick) {
  const Proof proof = proofs_.prove(course_.pose, motion, duration, tick.clock, tick.work);
  tick.report.recovering |= proof.recovering;
  tick.report.overlapping |= proof.overlapping;
  return proof;
}

void Proxy::commit(const ToolMotions& motion, Scalar t, ToolSet moving) {
  proofs_.commit(course_.pose, motion, t);
  const ToolPoses before = std::exchange(course_.pose, motion.at(t));
  for (std::size_t k = 0; k < scene_.tools.size(); ++k) {
    if (moving[k]) {
      course_.last_step[k] = step_between(before[k], course_.pose[k]);
      course_.rate_before[k] = std::exchange(course_.rate[k], scaled(course_.last_step[k], 1 / t));
    }
    paths_[k].push_back({paths_[k].back().time + t, course_.pose[k]});
  }
  contacts_.pass(t);
  scene_.place(course_.pose);
  for (const auto& obstacle : scene_.obstacles) obstacle->pass(t);
  note_progress();
}

void Proxy::note_progress() {
  for (std::size_t k = 0; k < scene_.scene_obstacles; ++k) {
    path_progress_.push_back(scene_.obstacles[k]->progress());
  }
}

// For so long the forces of the last solve act.
void Proxy::add_impulses(Scalar time) {
  if (!(time > 0)) return;
  for (const HoldPoint& hold : contacts_.holds()) {
    if (hold.impulse_W.isZero(0) || hold.other) continue;
    impulses_[scene_.bodies[hold.body].tool].push_back(
        {hold.obstacle, hold.p_WA, hold.surface, time * force_W(hold)});
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
