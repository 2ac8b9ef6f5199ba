// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/proxy.h"

#include <algorithm>
#include <cmath>
#include <tuple>
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
  // Once stuck, only ticks in which tissue stands set the pace.
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

namespace {

// A distance is measured again when its bounds are farther apart than this fraction of the rest
// offset and than the options allow.
constexpr Scalar kVagueShare = 0.25;

// It is then measured to this fraction of what is allowed, so that it lasts a while.
constexpr Scalar kMeasuredShare = 0.9;

}  // namespace

// Both bounds hold, whatever was found.
void Proxy::take(const PairDistance& found, ProxyPair& pair) {
  const Scalar lower = std::max(pair.distance.lower, found.lower);
  if (found.upper < pair.distance.upper) pair.distance = found;
  pair.distance.lower = lower;
}

void Proxy::measure(ProxyPair& pair, const DistanceWish& wish, WorkShare& share,
                    TickStatistics& work) {
  ++work.distance_queries;
  take(obstacles_[pair.obstacle]->measure(bodies_[pair.body], body_pose(pair.body), wish, share,
                                          pair.kept),
       pair);
}

// The clearance is that of the nearest body: others only have to be proven farther away. Relative
// to the lower bound the upper one may exceed it by the tolerance.
DistanceWish Proxy::wish_for(std::size_t obstacle) const {
  Scalar upper = kInfinity;
  for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
    upper = std::min(upper, pairs_[k].distance.upper);
  }
  const Scalar free = std::min(upper, std::abs(upper - obstacles_[obstacle]->margin));
  const Scalar tolerance = options_.clearance_tolerance;
  const Scalar allowed = (upper < kInfinity ? tolerance / (1 + tolerance) * free : 0) +
                         kVagueShare * options_.rest_offset;
  return {upper, allowed, kMeasuredShare * allowed};
}

// How many times farther than allowed the pair's lower bound is below the clearance's upper one.
Scalar Proxy::excess(const ProxyPair& pair, const DistanceWish& wish) const {
  return (wish.farthest - pair.distance.lower) / wish.allowed;
}

// The pairs first whose bounds are the worst for what is allowed; those that are left when the
// share is used up are the worst in the next tick.
void Proxy::measure(WorkShare share, TickStatistics& work) {
  if (share.clock.cutoff()) return;
  loose_.clear();
  for (std::size_t obstacle = 0; obstacle < obstacles_.size(); ++obstacle) {
    refresh(obstacle);
    const DistanceWish wish = wish_for(obstacle);
    for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
      const Scalar times = excess(pairs_[k], wish);
      if (times > 1) loose_.push_back({times, k});
    }
  }
  std::sort(loose_.begin(), loose_.end(), [](const Loose& x, const Loose& y) {
    return x.excess != y.excess ? x.excess > y.excess : x.pair < y.pair;
  });
  for (const Loose& loose : loose_) {
    if (share.is_over()) return;
    ProxyPair& pair = pairs_[loose.pair];
    const DistanceWish wish = wish_for(pair.obstacle);
    if (excess(pair, wish) > 1) measure(pair, wish, share, work);
  }
}

// Re-measure the last nearest points first; often that tightens the bounds enough.
void Proxy::refresh(std::size_t obstacle) {
  const DistanceWish wish = wish_for(obstacle);
  for (std::size_t k = obstacle; k < pairs_.size(); k += obstacles_.size()) {
    ProxyPair& pair = pairs_[k];
    if (!(pair.distance.upper <= wish.farthest) || !(excess(pair, wish) > 1)) continue;
    take(obstacles_[obstacle]->measure_again(bodies_[pair.body], body_pose(pair.body), pair.kept),
         pair);
  }
}

namespace {

// Holds are gathered up to this many rest offsets beyond the rest gap, plus the tool's
// displacement, up to the limit; the proof finds contacts farther away. At a slower pace the reach
// beyond the rest gap is less. Otherwise gathering would be cut off every tick and the tool could
// never leave.
constexpr Scalar kReach = 1.5;
constexpr Scalar kMostReach = 20;

// After a slip, cap the prediction slack at this many rest offsets; the proof catches the rest.
constexpr Scalar kMostSurprise = 2;

// A search for holds may always spend so many pieces of work, and twice as many as the last one
// did. If they do not suffice, the proof finds the holds that are missing, and the next search is
// faster for what this one has learnt.
constexpr std::int64_t kSearchWork = 250;

// Two holds closer than this many rest offsets with nearly the same normal are one.
constexpr Scalar kSamePlace = 2;
constexpr Scalar kSameNormal = 0.999;  // cosine of 2.6 degrees

// A hit that a known hold did not prevent is another one, even where their normals are near each
// other; with the very same normal it asks for more room instead.
constexpr Scalar kSameHit = 1 - 1e-8;  // literal: cosine of 0.008 degrees

// Radians that the tool or a hinge turns in one motion against holds: these are linear in the turn,
// and a tick's path has poses only, which do not tell of half turns and more between them.
constexpr Scalar kMostTurn = 1;

// A motion against holds is at most so many times as long as the last ones of tool, device and
// tissue together, besides so many rest offsets: a tool that slips gathers speed over some ticks.
// Its whole way in one would take longer to prove than a tick has.
constexpr Scalar kMostGrowth = 1.3;
constexpr Scalar kMostSlip = 2;

// So many holds are kept at the slowest pace: with fewer the proof finds the others, one by one.
constexpr int kFewestHolds = 8;

// A repeated hit pushes the tool away by this fraction of the rest offset, doubled each time.
constexpr Scalar kPush = 0.25;

// The curvature of a hold is taken into account if it exceeds this fraction of the rest offset.
constexpr Scalar kBend = 0.1;

bool is_same_place(const HoldPoint& x, const HoldPoint& y, Scalar apart,
                   Scalar least_cosine = kSameNormal) {
  return x.body == y.body && x.obstacle == y.obstacle &&
         (x.p_WB - y.p_WB).squaredNorm() <= apart * apart &&
         x.nhat_AB_W.dot(y.nhat_AB_W) >= least_cosine;
}

bool is_named_before(const HoldPoint& x, const HoldPoint& y) {
  return std::tie(x.body, x.obstacle, x.key) < std::tie(y.body, y.obstacle, y.key);
}

}  // namespace

// A search that is cut off would be so again in the next tick, before the tool has moved: the next
// tick goes on with what is known.
void Proxy::gather_holds(const ToolStep& wish, const Piece& piece, WorkClock& clock) {
  if (std::exchange(was_hasty_, false)) return carry_holds();
  found_.clear();
  const std::int64_t before = clock.checkpoints();
  WorkShare share(clock, std::max(kSearchWork, 2 * search_work_));
  const ToolMotion motion(pose_, wish, piece.duration, hinges_);
  for (ProxyPair& pair : pairs_) {
    const Obstacle& obstacle = *obstacles_[pair.obstacle];
    if (!obstacle.is_hard() || pair.is_overlapping) continue;
    const Scalar least_reach = obstacle.margin + (1 + pace_ * kReach) * options_.rest_offset;
    const Scalar most_moved = kMostReach * options_.rest_offset;
    if (pair.distance.lower > least_reach + most_moved) continue;
    if (clock.is_over()) return keep_found();
    const Scalar moved =
        likely_step(bodies_[pair.body], motion, piece.duration) + obstacle.speed() * piece.duration;
    const Scalar reach = least_reach + std::min(moved, most_moved);
    if (pair.distance.lower > reach) continue;
    const std::size_t first = found_.size();
    ExpectedApproach approach{.least = least_reach, .reach = reach};
    expect(pair, piece.duration, approach);
    obstacle.add_holds(bodies_[pair.body], body_pose(pair.body), approach, share, pair.kept,
                       memory_, found_);
    for (std::size_t k = first; k < found_.size(); ++k) {
      found_[k].body = pair.body;
      found_[k].obstacle = pair.obstacle;
    }
  }
  if (clock.cutoff()) return keep_found();
  search_work_ = clock.checkpoints() - before;
  if (share.is_used_up()) {
    carry_holds();
    found_.insert(found_.end(), holds_.begin(), holds_.end());
  }
  last_holds_.swap(holds_);
  thin_holds();
  warm_start();
  holds_from_ = pose_;
  holds_since_ = 0;
}

// Moves what was found earlier to where it is now: with the body and the tissue.
void Proxy::carry_holds() {
  for (HoldPoint& hold : holds_) {
    const ToolBody& body = bodies_[hold.body];
    const RigidPose X_WB_from = holds_from_.X_WT * body_in_tool(body, hinges_, holds_from_);
    hold.p_WB = body_pose(hold.body) * (X_WB_from.inverse() * hold.p_WB);
    hold.p_WA += holds_since_ * hold.v_WA;
    hold.curvature = 0;
    hold.push = 0;
  }
  holds_from_ = pose_;
  holds_since_ = 0;
  std::erase_if(holds_, [&](const HoldPoint& hold) {
    const Scalar far = obstacles_[hold.obstacle]->margin + (1 + kReach) * options_.rest_offset;
    return !(hold.gap() <= far) ||
           pairs_[hold.body * obstacles_.size() + hold.obstacle].is_overlapping;
  });
}

// What holds stands now. Where it was closing in, solves had no end, and their forces grew until
// friction could hold anything.
void Proxy::release_holds() {
  for (HoldPoint& hold : holds_) {
    hold.v_WA.setZero();
    hold.impulse_W.setZero();
  }
}

// The search was cut off: what it found, besides what was known.
void Proxy::keep_found() {
  was_hasty_ = true;
  carry_holds();
  for (const HoldPoint& hold : found_) {
    if (holds_.size() < most_holds()) add_if_new(hold);
  }
}

Scalar Proxy::size_of(const ToolBody& body, const ToolStep& step) const {
  return ToolMotion(pose_, step, 1, hinges_).largest_displacement(body, 1);
}

// A device far inside what holds the tool pulls it a long way, but it will hardly move farther than
// the device did, or than last time. Holds farther away are found by the proof.
Scalar Proxy::likely_step(const ToolBody& body, const ToolMotion& wished, Scalar duration) const {
  return std::min(wished.largest_displacement(body, duration),
                  size_of(body, goal_step_) + size_of(body, last_step_));
}

// The tool is expected to go on as in its last motion, give or take what has changed of late in its
// own rate and in the device's. Where that is wrong the proof finds the holds that are missing.
void Proxy::expect(const ProxyPair& pair, Scalar duration, ExpectedApproach& approach) const {
  const ToolBody& body = bodies_[pair.body];
  const ToolMotion motion(pose_, scaled(rate_, duration), duration, hinges_);
  const Twist twist = motion.of(body).twist(0);
  approach.v_W = duration * twist.v_WB;
  approach.w_W = duration * twist.w_WB;
  approach.origin_W = body_pose(pair.body).translation();
  const Scalar surprise = size_of(body, difference(goal_step_, last_goal_step_)) +
                          size_of(body, scaled(difference(rate_, rate_before_), duration)) +
                          obstacles_[pair.obstacle]->speed() * duration;
  approach.slack = std::min(surprise, kMostSurprise * options_.rest_offset);
}

// Fewer at a slower pace, since solves take long; leaves space for those that the proof will find.
std::size_t Proxy::most_holds() const {
  const int all = 1 + options_.max_contacts - options_.max_attempts;
  return std::size_t(std::max(std::min(kFewestHolds, all), int(pace_ * all)));
}

void Proxy::add_if_new(const HoldPoint& hold) {
  const Scalar apart = kSamePlace * options_.rest_offset;
  const bool is_known = std::any_of(holds_.begin(), holds_.end(), [&](const HoldPoint& kept) {
    return is_same_place(kept, hold, apart);
  });
  if (!is_known) holds_.push_back(hold);
}

// The nearest first, one for each point, no more than the solver may have.
void Proxy::thin_holds() {
  const auto excess = [&](const HoldPoint& hold) {
    return hold.gap() - obstacles_[hold.obstacle]->margin;
  };
  std::sort(found_.begin(), found_.end(), [&](const HoldPoint& x, const HoldPoint& y) {
    const Scalar excess_x = excess(x), excess_y = excess(y);
    if (excess_x != excess_y) return excess_x < excess_y;
    return is_named_before(x, y);
  });
  holds_.clear();
  for (const HoldPoint& hold : found_) {
    if (holds_.size() >= most_holds()) break;
    add_if_new(hold);
  }
}

void Proxy::warm_start() {
  for (HoldPoint& hold : holds_) {
    const auto same = std::find_if(last_holds_.begin(), last_holds_.end(), [&](const auto& last) {
      return last.body == hold.body && last.obstacle == hold.obstacle && last.key == hold.key;
    });
    if (same != last_holds_.end()) hold.impulse_W = same->impulse_W;
  }
}

// How much the gap at the end of what is tried of a step differs from the linear one, because the
// material points rotate. It grows with the square of the part that is tried, and the solve counts
// in whole steps: of a step of which little is tried, little of its curvature matters.
Scalar Proxy::bend_holds(const ToolMotion& motion, const ToolStep& step, Scalar part,
                         Scalar end_time) {
  const ToolPose end = motion.at(end_time);
  Scalar change = 0;
  for (HoldPoint& hold : holds_) {
    const ToolBody& body = bodies_[hold.body];
    const RigidPose X_BW = body_pose(hold.body).inverse();
    const RigidPose X_WB_end = end.X_WT * body_in_tool(body, hinges_, end);
    const Vector3 r_W = hold.p_WB - pose_.X_WT.translation();
    Vector3 linear = step.v_W + step.w_W.cross(r_W);
    if (body.hinge) {
      const RigidPose X_WJ = pose_.X_WT * hinges_[*body.hinge].X_TJ;
      const Vector3 axis = X_WJ.rotation().col(2);
      linear += step.angles[*body.hinge] * axis.cross(hold.p_WB - X_WJ.translation());
    }
    const Vector3 moved = X_WB_end * (X_BW * hold.p_WB) - hold.p_WB;
    const Scalar curvature = hold.nhat_AB_W.dot(moved / part - linear);
    change = std::max(change, part * std::abs(curvature - hold.curvature));
    hold.curvature = curvature;
  }
  return change;
}

ToolStep Proxy::solve(const StepGoal& goal, WorkClock& clock, TickStatistics& work) {
  constexpr int kMostBends = 2;
  ToolStep step;
  for (int k = 0; k <= kMostBends; ++k) {
    step = solver_.solve(goal, obstacles_, holds_, clock);
    ++work.solves;
    if (clock.cutoff()) break;
    const ToolMotion motion(pose_, step, goal.duration, hinges_);
    const Scalar horizon = horizon_of(step, goal.duration);
    const Scalar part = horizon / goal.duration;
    if (bend_holds(motion, step, part, horizon) <= kBend * options_.rest_offset) break;
  }
  return step;
}

// How much of a step's duration is tried at once.
Scalar Proxy::horizon_of(const ToolStep& step, Scalar duration) const {
  if (holds_.empty()) return duration;
  Scalar turn = step.w_W.norm();
  for (const Scalar angle : step.angles) turn = std::max(turn, std::abs(angle));
  Scalar part = std::min(Scalar{1}, kMostTurn / turn);
  Scalar tissue = 0;
  for (const auto& obstacle : obstacles_) tissue = std::max(tissue, obstacle->speed() * duration);
  for (const ToolBody& body : bodies_) {
    const Scalar last = size_of(body, goal_step_) + size_of(body, last_tick_step_);
    const Scalar most = pace_ * (kMostGrowth * last + kMostSlip * options_.rest_offset);
    part = std::min(part, (most + kMostGrowth * tissue) / size_of(body, step));
  }
  return part < 1 ? part * duration : duration;
}

void Proxy::add_hit(const HoldPoint& hit) {
  const Scalar apart = kSamePlace * options_.rest_offset;
  for (HoldPoint& hold : holds_) {
    if (!is_same_place(hold, hit, apart, kSameHit)) continue;
    hold.push = hold.push > 0 ? 2 * hold.push : kPush * options_.rest_offset;
    return;
  }
  holds_.push_back(hit);
}

}  // namespace dyop::haptics_internal
