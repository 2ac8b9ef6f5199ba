// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/active_contacts.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

namespace dyop::haptics_internal {
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

// A search that takes more pieces than this makes the reach of the next ones beyond the rest gap
// smaller, by at most so much at once, down to a part; one that takes fewer, larger. Between fine
// meshes each bit of reach adds hundreds of pairs that hardly ever matter. With none at all, tools
// stop at contacts that only the proof finds.
constexpr Scalar kUsualSearch = 300;
constexpr Scalar kFastestShrink = 0.5;
constexpr Scalar kFastestGrowth = 1.1;
constexpr Scalar kLeastReachPart = 0.2;

// So many holds need no further memory before they are thinned out.
constexpr std::size_t kReservedHolds = 1024;

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

// A motion may leave the trocar by this fraction of the rest offset.
constexpr Scalar kTrocarShare = 0.5;
// A solve gets wishes to turn about the trocar by at most so much, radians. Larger: jumps leave the
// trocar by more than the rest offset. Smaller: the tool lags behind a device held off it.
constexpr Scalar kMostTrocarTurn = 0.25;

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

ActiveContacts::ActiveContacts(const LoopScene& scene, const ToolPoses& start)
    : scene_(scene),
      solver_(scene.tools, scene.bodies, std::size_t(scene.options.max_contacts)),
      holds_from_(start) {
  found_.reserve(kReservedHolds);
  apart_.reserve(kReservedHolds);
}

bool ActiveContacts::can_hold() const {
  return !holds_.empty() || std::any_of(scene_.tools.begin(), scene_.tools.end(),
                                        [](const HapticTool& tool) { return !!tool.trocar; });
}

void ActiveContacts::forget(std::size_t obstacle) {
  std::erase_if(holds_, [&](const HoldPoint& hold) { return hold.obstacle == obstacle; });
}

void ActiveContacts::forget_all() {
  holds_.clear();
  last_holds_.clear();
  has_searched_ = false;
  skips_search_ = false;
  search_work_ = 0;
  reach_part_ = 1;
}

void ActiveContacts::adapt_reach(std::int64_t pieces) {
  const Scalar change =
      std::clamp(kUsualSearch / Scalar(pieces + 1), kFastestShrink, kFastestGrowth);
  reach_part_ = std::clamp(change * reach_part_, kLeastReachPart, Scalar{1});
}

// What is at most so far away is looked for, besides what comes nearer.
Scalar ActiveContacts::least_reach(const Obstacle& obstacle, Scalar part) const {
  return obstacle.margin + (1 + part * kReach) * scene_.options.rest_offset;
}

// A search that is cut off would be so again in the next tick, before the tool has moved: the next
// tick goes on with what is known.
void ActiveContacts::gather(const Course& course, const ToolSteps& wish, Scalar duration,
                            PairProofs& proofs, WorkClock& clock) {
  has_searched_ = !std::exchange(skips_search_, false);
  if (!has_searched_) return carry(course, proofs);
  found_.clear();
  const std::int64_t before = clock.checkpoints();
  WorkShare share(clock, std::max(kSearchWork, 2 * search_work_));
  const ToolMotions motion(course.pose, wish, duration, scene_.tools);
  for (ProxyPair& pair : proofs.pairs()) {
    const Obstacle& obstacle = *scene_.obstacles[pair.obstacle];
    if (!obstacle.is_hard() || pair.is_overlapping) continue;
    const Scalar most_moved = kMostReach * scene_.options.rest_offset;
    if (pair.distance.lower > least_reach(obstacle, course.pace) + most_moved) continue;
    if (clock.is_over()) return keep_found(course, proofs);
    const auto other = scene_.body_of(pair.obstacle);
    const Scalar moved = std::min(
        most_moved, likely_step(course, scene_.bodies[pair.body], motion, duration) +
                        (other ? likely_step(course, scene_.bodies[*other], motion, duration)
                               : obstacle.speed() * duration));
    // A long step needs all of it.
    const Scalar part = std::max(reach_part_, moved / most_moved);
    const Scalar least = least_reach(obstacle, part * course.pace);
    const Scalar reach = least + moved;
    if (pair.distance.lower > reach) continue;
    const std::size_t first = found_.size();
    ExpectedApproach approach{.least = least, .reach = reach};
    expect(course, pair, duration, approach);
    // How the other tool goes on is not in it.
    if (other) approach.least = reach;
    obstacle.add_holds(scene_.bodies[pair.body], scene_.body_pose(course.pose, pair.body), approach,
                       share, pair.kept, proofs.memory(), found_);
    for (std::size_t k = first; k < found_.size(); ++k) {
      found_[k].body = pair.body;
      found_[k].obstacle = pair.obstacle;
      found_[k].other = other;
    }
  }
  if (clock.cutoff()) return keep_found(course, proofs);
  search_work_ = clock.checkpoints() - before;
  adapt_reach(search_work_);
  if (share.is_used_up()) {
    carry(course, proofs);
    found_.insert(found_.end(), holds_.begin(), holds_.end());
  }
  last_holds_.swap(holds_);
  thin(course);
  warm_start();
  holds_from_ = course.pose;
  holds_since_ = 0;
}

// Moves what was found earlier to where it is now: with the body and the tissue.
void ActiveContacts::carry(const Course& course, const PairProofs& proofs) {
  for (HoldPoint& hold : holds_) {
    const RigidPose X_WB_from = scene_.body_pose(holds_from_, hold.body);
    hold.p_WB = scene_.body_pose(course.pose, hold.body) * (X_WB_from.inverse() * hold.p_WB);
    if (hold.other) {
      const RigidPose X_WA_from = scene_.body_pose(holds_from_, *hold.other);
      hold.p_WA = scene_.body_pose(course.pose, *hold.other) * (X_WA_from.inverse() * hold.p_WA);
    }
    hold.p_WA += holds_since_ * hold.v_WA;
    hold.curvature = 0;
    hold.push = 0;
  }
  holds_from_ = course.pose;
  holds_since_ = 0;
  std::erase_if(holds_, [&](const HoldPoint& hold) {
    const Scalar far =
        scene_.obstacles[hold.obstacle]->margin + (1 + kReach) * scene_.options.rest_offset;
    return !(hold.gap() <= far) || proofs.pair(hold.body, hold.obstacle).is_overlapping;
  });
}

void ActiveContacts::keep() {
  kept_.holds.assign(holds_.begin(), holds_.end());
  kept_.from = holds_from_;
  kept_.since = holds_since_;
}

void ActiveContacts::restore() {
  holds_.assign(kept_.holds.begin(), kept_.holds.end());
  holds_from_ = kept_.from;
  holds_since_ = kept_.since;
}

// What holds stands now. Where it was closing in, solves had no end, and their forces grew until
// friction could hold anything.
void ActiveContacts::release() {
  for (HoldPoint& hold : holds_) {
    hold.v_WA.setZero();
    hold.impulse_W.setZero();
  }
}

// The search was cut off: what it found, besides what was known.
void ActiveContacts::keep_found(const Course& course, const PairProofs& proofs) {
  skips_search_ = true;
  reach_part_ = std::max(kLeastReachPart, kFastestShrink * reach_part_);
  carry(course, proofs);
  for (const HoldPoint& hold : found_) {
    if (holds_.size() < most_holds(course)) add_if_new(hold);
  }
}

Scalar ActiveContacts::size_of(const Course& course, const ToolBody& body,
                               const ToolStep& step) const {
  return ToolMotion(course.pose[body.tool], step, 1, scene_.tools[body.tool].hinges)
      .largest_displacement(body, 1);
}

// A device far inside what holds the tool pulls it a long way, but it will hardly move farther than
// the device did, or than last time. Holds farther away are found by the proof.
Scalar ActiveContacts::likely_step(const Course& course, const ToolBody& body,
                                   const ToolMotions& wished, Scalar duration) const {
  return std::min(wished.largest_displacement(body, duration),
                  size_of(course, body, course.goal_step[body.tool]) +
                      size_of(course, body, course.last_step[body.tool]));
}

// The tool is expected to go on as in its last motion, give or take what has changed of late in its
// own rate and in the device's. Where that is wrong the proof finds the holds that are missing.
void ActiveContacts::expect(const Course& course, const ProxyPair& pair, Scalar duration,
                            ExpectedApproach& approach) const {
  const ToolBody& body = scene_.bodies[pair.body];
  const std::size_t tool = body.tool;
  const ToolMotion motion(course.pose[tool], scaled(course.rate[tool], duration), duration,
                          scene_.tools[tool].hinges);
  const Twist twist = motion.of(body).twist(0);
  approach.v_W = duration * twist.v_WB;
  approach.w_W = duration * twist.w_WB;
  approach.origin_W = scene_.body_pose(course.pose, pair.body).translation();
  const Scalar surprise =
      size_of(course, body, difference(course.goal_step[tool], course.last_goal_step[tool])) +
      size_of(course, body,
              scaled(difference(course.rate[tool], course.rate_before[tool]), duration)) +
      scene_.obstacles[pair.obstacle]->speed() * duration;
  approach.slack = std::min(surprise, kMostSurprise * scene_.options.rest_offset);
  approach.radius = body.shape->bounding_radius();
}

// Fewer at a slower pace, since solves take long; leaves space for those that the proof will find.
std::size_t ActiveContacts::most_holds(const Course& course) const {
  const int all = 1 + scene_.options.max_contacts - scene_.options.max_attempts;
  return std::size_t(std::max(std::min(kFewestHolds, all), int(course.pace * all)));
}

void ActiveContacts::add_if_new(const HoldPoint& hold) {
  const Scalar apart = kSamePlace * scene_.options.rest_offset;
  const bool is_known = std::any_of(holds_.begin(), holds_.end(), [&](const HoldPoint& kept) {
    return is_same_place(kept, hold, apart);
  });
  if (!is_known) holds_.push_back(hold);
}

namespace {

// Gaps that differ by less than this part of the rest offset are the same: which is the nearest is a
// matter of rounding, and changes from tick to tick.
constexpr Scalar kSameGap = 0.05;

// Squared distance of two holds; a normal counts like a lever of that length.
Scalar squared_distance(const HoldPoint& x, const HoldPoint& y, Scalar lever) {
  return (x.p_WB - y.p_WB).squaredNorm() +
         lever * lever * (x.nhat_AB_W - y.nhat_AB_W).squaredNorm();
}

// Chooses holds one after the other, each as far as possible from all before. Of those as far the
// first counts, so that rounding does not choose.
class Spread {
 public:
  // The scratch is kept by the caller, as a tick must not allocate.
  Spread(std::span<const HoldPoint> holds, const std::vector<HoldPoint>& chosen,
         std::vector<Scalar>& scratch)
      : holds_(holds), apart_(scratch) {
    apart_.clear();
    Vector3 middle = Vector3::Zero();
    for (const HoldPoint& hold : holds) middle += hold.p_WB / Scalar(holds.size());
    for (const HoldPoint& hold : holds) {
      apart_.push_back((hold.p_WB - middle).squaredNorm());
      lever_ = std::max(lever_, std::sqrt(apart_.back()));
    }
    if (chosen.empty()) return;
    std::fill(apart_.begin(), apart_.end(), kInfinity);
    for (const HoldPoint& hold : chosen) add(hold);
  }

  // The next one; null if all that are left are nearer than `least` to others.
  const HoldPoint* next(Scalar least) {
    constexpr Scalar kFarther = 1 + 1e-6;  // literal: above rounding
    std::size_t farthest = 0;
    for (std::size_t k = 1; k < holds_.size(); ++k) {
      if (apart_[k] > kFarther * apart_[farthest]) farthest = k;
    }
    if (is_begun_ && !(apart_[farthest] > least * least)) return nullptr;
    if (!is_begun_) std::fill(apart_.begin(), apart_.end(), kInfinity);
    add(holds_[farthest]);
    return &holds_[farthest];
  }

 private:
  void add(const HoldPoint& hold) {
    is_begun_ = true;
    for (std::size_t k = 0; k < holds_.size(); ++k) {
      apart_[k] = std::min(apart_[k], squared_distance(holds_[k], hold, lever_));
    }
  }

  std::span<const HoldPoint> holds_;
  std::vector<Scalar>& apart_;  // from the chosen ones, squared; at first from the middle
  Scalar lever_ = 0;
  bool is_begun_ = false;
};

}  // namespace

// The nearest first, one for each point, no more than the solver may have. Of a face that lies on a
// fine mesh many are as near: those that are spread over it.
void ActiveContacts::thin(const Course& course) {
  const auto excess = [&](const HoldPoint& hold) {
    return hold.gap() - scene_.obstacles[hold.obstacle]->margin;
  };
  std::sort(found_.begin(), found_.end(), [&](const HoldPoint& x, const HoldPoint& y) {
    const Scalar excess_x = excess(x), excess_y = excess(y);
    if (excess_x != excess_y) return excess_x < excess_y;
    return is_named_before(x, y);
  });
  holds_.clear();
  const std::size_t most = most_holds(course);
  std::size_t next = 0;
  if (found_.size() > most) {
    const Scalar same = kSameGap * scene_.options.rest_offset;
    const Scalar last = excess(found_[most - 1]);
    while (excess(found_[next]) < last - same) add_if_new(found_[next++]);
    std::size_t end = next;
    while (end < found_.size() && excess(found_[end]) <= last + same) ++end;
    add_spread(next, end, most);
    next = end;
  }
  for (; next < found_.size() && holds_.size() < most; ++next) add_if_new(found_[next]);
}

// Of those found from `first` on to `last`.
void ActiveContacts::add_spread(std::size_t first, std::size_t last, std::size_t most) {
  const std::span<HoldPoint> equal = std::span(found_).subspan(first, last - first);
  std::sort(equal.begin(), equal.end(), is_named_before);
  Spread spread(equal, holds_, apart_);
  while (holds_.size() < most) {
    const HoldPoint* hold = spread.next(kSamePlace * scene_.options.rest_offset);
    if (!hold) return;
    add_if_new(*hold);
  }
}

void ActiveContacts::warm_start() {
  for (HoldPoint& hold : holds_) {
    const auto same = std::find_if(last_holds_.begin(), last_holds_.end(), [&](const auto& last) {
      return last.body == hold.body && last.obstacle == hold.obstacle && last.key == hold.key;
    });
    if (same != last_holds_.end()) hold.impulse_W = same->impulse_W;
  }
}

// By how much a point of a body leaves the line that it takes at first.
Vector3 ActiveContacts::bend_of(std::size_t number, const Vector3& p_W, const ToolPoses& from,
                                const ToolPoses& end, const ToolSteps& steps, Scalar part) const {
  const ToolBody& body = scene_.bodies[number];
  const RigidPose& X_WT = from[body.tool].X_WT;
  const ToolStep& step = steps[body.tool];
  const RigidPose X_BW = scene_.body_pose(from, number).inverse();
  const RigidPose X_WB_end = scene_.body_pose(end, number);
  Vector3 linear = step.v_W + step.w_W.cross(p_W - X_WT.translation());
  if (body.hinge) {
    const RigidPose X_WJ = X_WT * scene_.tools[body.tool].hinges[*body.hinge].X_TJ;
    const Vector3 axis = X_WJ.rotation().col(2);
    linear += step.angles[*body.hinge] * axis.cross(p_W - X_WJ.translation());
  }
  const Vector3 moved = X_WB_end * (X_BW * p_W) - p_W;
  return moved / part - linear;
}

// How much the gap at the end of what is tried of a step differs from the linear one, because the
// material points rotate. It grows with the square of the part that is tried, and the solve counts
// in whole steps: of a step of which little is tried, little of its curvature matters.
Scalar ActiveContacts::bend(const ToolPoses& from, const ToolMotions& motion,
                            const ToolSteps& steps, Scalar part, Scalar end_time) {
  const ToolPoses end = motion.at(end_time);
  Scalar change = 0;
  for (HoldPoint& hold : holds_) {
    Vector3 bent_W = bend_of(hold.body, hold.p_WB, from, end, steps, part);
    if (hold.other) bent_W -= bend_of(*hold.other, hold.p_WA, from, end, steps, part);
    const Scalar curvature = hold.nhat_AB_W.dot(bent_W);
    change = std::max(change, part * std::abs(curvature - hold.curvature));
    hold.curvature = curvature;
  }
  return change;
}

ToolSteps ActiveContacts::solve(const Course& course, const StepGoal& goal, WorkClock& clock,
                                TickStatistics& work) {
  constexpr int kMostBends = 2;
  ToolSteps steps;
  for (int k = 0; k <= kMostBends; ++k) {
    steps = solver_.solve(goal, scene_.obstacles, holds_, clock);
    ++work.solves;
    if (clock.cutoff()) break;
    const ToolMotions motion(course.pose, steps, goal.duration, scene_.tools);
    const Scalar horizon = horizon_of(course, steps, goal.duration);
    const Scalar part = horizon / goal.duration;
    if (bend(course.pose, motion, steps, part, horizon) <= kBend * scene_.options.rest_offset) {
      break;
    }
  }
  return steps;
}

// How much of a step's duration is tried at once.
Scalar ActiveContacts::horizon_of(const Course& course, const ToolSteps& steps,
                                  Scalar duration) const {
  if (!can_hold()) return duration;
  Scalar turn = 0;
  for (const ToolStep& step : steps) {
    turn = std::max(turn, step.w_W.norm());
    for (const Scalar angle : step.angles) turn = std::max(turn, std::abs(angle));
  }
  Scalar part = std::min(Scalar{1}, kMostTurn / turn);
  Scalar tissue = 0;
  for (const auto& obstacle : scene_.obstacles)
    tissue = std::max(tissue, obstacle->speed() * duration);
  for (const ToolBody& body : scene_.bodies) {
    const Scalar last = size_of(course, body, course.goal_step[body.tool]) +
                        size_of(course, body, course.last_tick_step[body.tool]);
    const Scalar most = course.pace * (kMostGrowth * last + kMostSlip * scene_.options.rest_offset);
    const Scalar size = size_of(course, body, steps[body.tool]);
    part = std::min(part, (most + kMostGrowth * tissue) / size);
  }
  part = std::min(part, trocar_part(course.pose, steps));
  return part < 1 ? part * duration : duration;
}

// A wish to go across the axis becomes a turn, too.
ActiveContacts::TrocarTurn ActiveContacts::trocar_turn(std::size_t tool, const ToolPose& from,
                                                       const ToolStep& step) const {
  const ToolTrocar& trocar = *scene_.tools[tool].trocar;
  const Vector3 axis_W = (from.X_WT.rotation() * trocar.axis_T).normalized();
  const Vector3 away_W = trocar.p_W - from.X_WT.translation();
  const Scalar lever = std::max(away_W.norm(), reach_of(scene_.bodies, tool));
  return {step.w_W.norm() + step.v_W.cross(axis_W).norm() / lever, lever};
}

// A motion with the turn w and the displacement v leaves the trocar by what these add at second
// order, at most |w| (|w| l / 2 + |v|) if T's origin is l away.
Scalar ActiveContacts::trocar_part(std::size_t tool, const ToolPose& from,
                                   const ToolStep& step) const {
  if (!scene_.tools[tool].trocar) return 1;
  const auto [turn, lever] = trocar_turn(tool, from, step);
  const Scalar error = turn * (turn * lever / 2 + step.v_W.norm());
  return std::min(Scalar{1}, std::sqrt(kTrocarShare * scene_.options.rest_offset / error));
}

// The solve takes turns for linear: how much of a wish it may get.
Scalar ActiveContacts::linear_part(const ToolPoses& from, const ToolSteps& wish) const {
  Scalar part = 1;
  for (std::size_t tool = 0; tool < wish.size(); ++tool) {
    if (!scene_.tools[tool].trocar) continue;
    part = std::min(part, kMostTrocarTurn / trocar_turn(tool, from[tool], wish[tool]).turn);
  }
  return part;
}

Scalar ActiveContacts::trocar_part(const ToolPoses& from, const ToolSteps& steps) const {
  Scalar part = 1;
  for (std::size_t tool = 0; tool < steps.size(); ++tool) {
    part = std::min(part, trocar_part(tool, from[tool], steps[tool]));
  }
  return part;
}

void ActiveContacts::add_hit(const HoldPoint& hit) {
  reach_part_ = 1;  // what a search misses costs another solve and proof
  const Scalar apart = kSamePlace * scene_.options.rest_offset;
  for (HoldPoint& hold : holds_) {
    if (!is_same_place(hold, hit, apart, kSameHit)) continue;
    hold.push = hold.push > 0 ? 2 * hold.push : kPush * scene_.options.rest_offset;
    return;
  }
  holds_.push_back(hit);
}

}  // namespace dyop::haptics_internal
