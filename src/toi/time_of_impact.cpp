#include "dyop/toi/time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tolerance.h"
#include "distance/enclosure.h"
#include "distance/piece_distance.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "toi/interruption.h"
#include "toi/rigid/moving_pair.h"
#include "toi/toi_check.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using internal::BodyInstant;
using internal::BoxSteps;
using internal::FacingPiece;
using internal::GjkGoal;
using internal::MovingPair;
using internal::MovingShape;
using internal::PieceDistance;
using internal::QueuedPair;
using internal::RadixQueue;
using internal::SafeStep;
using internal::ShapeTree;

// Set in the number of the second box of a pair that is far apart for its size: it is moved on in
// time before it is split.
constexpr std::int32_t kFarFlag = std::int32_t{1} << 30;

// Two boxes are looked at where the bodies stood for the pair before, if they move by less than
// this part of the boxes' half diagonals until their time: poses cost more than such a part of a
// step.
constexpr Scalar kStandingStill = 0.05;

// How far the bounds of a rough distance may be apart, as a share of what is left to the target.
// Larger: shorter steps; smaller: more work on each.
constexpr Scalar kRoughShare = 0.25;

// Best-first conservative advancement of one pair of shapes.
class ToiSearch {
 public:
  ToiSearch(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
            const TimeInterval& interval, const ToiOptions& options, internal::ToiMemory& memory);

  /// From the begin, or on from what the memory holds.
  ToiResult run();
  ToiResult resume();

 private:
  enum class Verdict { GoOn, Impact, TooCloseAtBegin, Stuck, Interrupted };

  const MovingShape& a() const { return pair_.a(); }
  const MovingShape& b() const { return pair_.b(); }
  Scalar noise() const { return pair_.noise(); }

  Scalar skip_turns();
  Scalar first_time();
  void push(Scalar time, std::int32_t box_a, std::int32_t box_b);
  void fetch_parts(const QueuedPair& pair) const;
  bool may_stand_still(const QueuedPair& pair) const;
  void open(const QueuedPair& pair);
  void advance(const QueuedPair& pair);
  PieceDistance measure(const QueuedPair& pair, const GjkGoal& goal);
  Verdict examine_leaves(const QueuedPair& pair);
  std::optional<bool> is_nearest(const PieceDistance& piece);
  ImpactContact make_contact(const PieceDistance& piece, const QueuedPair& pair) const;
  std::optional<Scalar> probe_hit(const QueuedPair& pair, const ImpactContact& contact);
  ToiResult finish_impact(const QueuedPair& pair);
  ToiResult finish_undecided(ToiStatus status, const QueuedPair& pair);
  void gather_contacts();
  bool begins_enclosed();
  ToiResult finish(ToiStatus status, Scalar t_safe);

  const TimeInterval interval_;
  const ToiOptions& options_;
  const Scalar lost_;     // at most this far apart at the begin: nothing can be guaranteed
  const Scalar floor_;    // the distance that is never undercut
  const Scalar contact_;  // at most this far apart, nearest and closing: impact
  const Scalar look_;     // boxes that come as near as this are looked into
  const Scalar near_;     // the largest distance of an impact
  const internal::BoxStepsKernels kernels_;

  MovingPair pair_;
  internal::ToiMemory& memory_;
  RadixQueue& queue_;
  internal::Interruption interruption_;
  ToiResult result_;
};

ToiSearch::ToiSearch(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                     const TimeInterval& interval, const ToiOptions& options,
                     internal::ToiMemory& memory)
    : interval_(interval),
      options_(options),
      lost_(options.target_distance + kLostFraction * options.distance_tolerance),
      floor_(options.target_distance + kFloorFraction * options.distance_tolerance),
      contact_(options.target_distance + kContactFraction * options.distance_tolerance),
      look_(options.target_distance + kLookFraction * options.distance_tolerance),
      near_(options.target_distance + options.distance_tolerance),
      kernels_(internal::box_steps_kernels(internal::best_instruction_set())),
      pair_(a, X_WA, b, X_WB, interval, look_),
      memory_(memory),
      queue_(memory.queue),
      interruption_(options) {}

void ToiSearch::push(Scalar time, std::int32_t box_a, std::int32_t box_b) {
  if (time == kInfinity) return;  // proven apart to the end
  queue_.push({time, box_a, box_b});
}

// Asks for the memory of what open() will read.
void ToiSearch::fetch_parts(const QueuedPair& pair) const {
  const bool opens_a = internal::opens_first(a().tree, pair.a, b().tree, pair.b);
  const ShapeTree& tree = opens_a ? a().tree : b().tree;
  tree.fetch(tree.child(opens_a ? pair.a : pair.b));
}

// Whether the time of the last pair will do for a pair of boxes, too: what is proven from there on
// holds as well, and keys do not fall below the pair's own.
bool ToiSearch::may_stand_still(const QueuedPair& pair) const {
  const Scalar way = (pair.time - pair_.time()) * pair_.largest_speed();
  return way * way <=
         kStandingStill * kStandingStill *
             (a().tree.squared_half_diagonal(pair.a) + b().tree.squared_half_diagonal(pair.b));
}

// Replaces a pair by the pairs of the larger box's parts with the other box.
void ToiSearch::open(const QueuedPair& pair) {
  const bool opens_a = internal::opens_first(a().tree, pair.a, b().tree, pair.b);
  const ShapeTree& tree = opens_a ? a().tree : b().tree;
  const std::int32_t child = tree.child(opens_a ? pair.a : pair.b);
  const int count = tree.node(child).count();
  const FacingPiece other = pair_.facing_piece(opens_a, opens_a ? pair.b : pair.a);
  BoxSteps steps;
  kernels_.group(tree.rows(child), 0, count, other, pair_.facing_motion(opens_a), &steps);
  result_.statistics.box_tests += count;
  for (int column = 0; column < count; ++column) {
    const std::int32_t part = ShapeTree::box_number(child, column);
    const std::int32_t flag = (steps.is_far >> column & 1) != 0 ? kFarFlag : 0;
    const Scalar time = std::max(pair.time, pair_.time() + steps.time[column]);
    push(time, opens_a ? part : pair.a, (opens_a ? pair.b : part) | flag);
  }
}

// Moves a pair of boxes on in time.
void ToiSearch::advance(const QueuedPair& pair) {
  ++result_.statistics.box_tests;
  const int column = ShapeTree::column_of(pair.a);
  BoxSteps steps;
  kernels_.one(a().tree.rows(pair.a / BoxGroup::kWidth), column, 1,
               pair_.facing_piece(true, pair.b), pair_.facing_motion(true), &steps);
  const Scalar time = std::max(pair.time, pair_.time() + steps.time[column]);
  // A step too short for its time must not come back as far away.
  const bool is_far = steps.is_far != 0 && time > pair.time;
  push(time, pair.a, is_far ? pair.b | kFarFlag : pair.b);
}

// Bodies that slide along one another stay as far apart as they are where they touch. The faces and
// edges beside that place come nearer until it is their turn: they do not collide. And at the begin
// nothing is proven of pairs that are still to be looked at: one that is nearer may be too close.
// Nothing if the search is to end before that is known.
std::optional<bool> ToiSearch::is_nearest(const PieceDistance& piece) {
  // Nothing was in contact before, or could have been.
  if (!memory_.has_resting_pair && pair_.time() > interval_.begin) return true;
  if (a().tree.convex() && b().tree.convex()) return true;
  internal::DistanceTraversal nearer(a().tree, b().tree, pair_.X_AB(), noise(), piece.upper,
                                     memory_.box_pairs);
  // Most of the rounding is that of the poses, which all pairs of pieces share.
  nearer.sought_middle = piece.middle();
  if (memory_.is_looking) {
    nearer.best = memory_.nearer;
  } else {
    nearer.start();
  }
  ToiStatistics& work = result_.statistics;
  const std::int64_t before = work.node_pairs;
  bool is_through = false;
  do {
    is_through = nearer.go_on(interruption_.portion(work.node_pairs));
    work.node_pairs = before + nearer.box_pairs;
  } while (!is_through && !interruption_.after(work.node_pairs));
  work.box_tests += nearer.statistics.box_tests;
  work.leaf_tests += nearer.statistics.leaf_tests;
  memory_.is_looking = !is_through;
  memory_.nearer = nearer.best;
  if (!is_through) return std::nullopt;
  // Later than at the begin nothing overlaps but for rounding.
  if (nearer.best.is_overlapping) return pair_.time() > interval_.begin;
  return !(nearer.best.middle() < piece.middle());
}

PieceDistance ToiSearch::measure(const QueuedPair& pair, const GjkGoal& goal) {
  return internal::piece_distance(a().tree, pair.a, b().tree, pair.b, pair_.X_AB(), noise(), goal,
                                  memory_.seed);
}

ToiSearch::Verdict ToiSearch::examine_leaves(const QueuedPair& pair) {
  ++result_.statistics.leaf_tests;
  // Far away a rough distance will do for a step.
  const GjkGoal goal{.apart = near_ + 4 * noise(), .share = kRoughShare};
  const PieceDistance piece = measure(pair, goal);
  // What lies this close at the begin was never proven apart. Later it cannot be there but for
  // rounding, and the time it is at was proven safe.
  if (pair_.time() == interval_.begin && !(piece.lower > lost_)) {
    result_.contact = make_contact(piece, pair);
    // Bounds wider than the tolerance do not tell near from far; nor does NaN.
    return piece.upper <= near_ ? Verdict::TooCloseAtBegin : Verdict::Stuck;
  }
  const bool is_near = piece.upper <= near_ + noise();
  const bool is_in_contact = piece.upper <= contact_ + noise();
  const bool is_approaching = is_near && pair_.is_closing(piece);
  if (is_approaching && is_in_contact) {
    const std::optional<bool> is_impact = is_nearest(piece);
    if (!is_impact) return Verdict::Interrupted;
    if (*is_impact) {
      result_.contact = make_contact(piece, pair);
      return Verdict::Impact;
    }
  }
  const bool is_resting = is_near && (is_in_contact || !is_approaching);
  memory_.has_resting_pair |= is_resting;
  // In contact and not closing: go on until the gap may have lost an eighth of the room that is
  // left, to be looked at again. So a pair that hops in the band keeps its height nearly, and
  // always has room.
  const Scalar room = std::max(2 * noise(), (piece.lower - lost_) / 8);
  const Scalar returning = std::max(lost_, piece.lower - room);
  const SafeStep step = pair_.leaf_step(piece, pair.a, pair.b, is_resting ? returning : floor_);
  const Scalar next = pair_.time() + step.time;
  if (!(next > pair_.time())) {
    result_.contact = make_contact(piece, pair);
    return is_near ? Verdict::Impact : Verdict::Stuck;
  }
  push(next, pair.a, pair.b);
  return Verdict::GoOn;
}

ImpactContact ToiSearch::make_contact(const PieceDistance& piece, const QueuedPair& pair) const {
  const RigidPose X_WA = RigidPose::from_trusted(pair_.now().a.R_WB, pair_.now().a.p_WB);
  ImpactContact contact{internal::witness_pair(piece, a().tree, pair.a, b().tree, pair.b, X_WA), 0};
  contact.closing_speed = pair_.closing_speed(piece);
  return contact;
}

// Goes on along the motion in doubling steps until the pair in contact is proven below the floor.
std::optional<Scalar> ToiSearch::probe_hit(const QueuedPair& pair, const ImpactContact& contact) {
  constexpr int kProbes = 12;
  if (!(contact.closing_speed > 0)) return std::nullopt;
  // Either above the floor or below it.
  const GjkGoal goal{.apart = floor_, .share = kInfinity, .hit = floor_ - 2 * noise()};
  const Scalar begin = pair_.time();
  // At the begin the gap may be below the floor already.
  const Scalar way = std::max(contact.upper - floor_, options_.distance_tolerance / 8);
  // literal: a little longer than to the floor, so that the first probe is below it as a rule.
  Scalar step = 1.25 * way / contact.closing_speed;
  for (int probe = 0; probe < kProbes && begin + step <= interval_.end; ++probe, step *= 2) {
    if (!(begin + step > begin)) continue;
    pair_.set_time(begin + step);
    const PieceDistance piece = measure(pair, goal);
    if (piece.upper < floor_ || piece.is_overlapping) return pair_.time();
  }
  return std::nullopt;
}

// Never empty: the contact that ended the search is within reach.
void ToiSearch::gather_contacts() {
  const Scalar reach =
      result_.contact->upper + options_.distance_tolerance + result_.rounding_allowance;
  result_.contacts = find_contacts(a().shape, result_.X_WA, b().shape, result_.X_WB, reach);
}

ToiResult ToiSearch::finish(ToiStatus status, Scalar t_safe) {
  result_.status = status;
  result_.t_safe = t_safe;
  result_.rounding_allowance = noise();
  const bool is_now = t_safe == pair_.time();
  const BodyInstant& now_a = pair_.now().a;
  const BodyInstant& now_b = pair_.now().b;
  result_.X_WA = is_now ? RigidPose::from_trusted(now_a.R_WB, now_a.p_WB) : a().motion.pose(t_safe);
  result_.X_WB = is_now ? RigidPose::from_trusted(now_b.R_WB, now_b.p_WB) : b().motion.pose(t_safe);
  if (status == ToiStatus::Impact && options_.with_contacts) gather_contacts();
  return std::move(result_);
}

ToiResult ToiSearch::finish_impact(const QueuedPair& pair) {
  ToiResult result = finish(ToiStatus::Impact, pair.time);
  result.t_hit = probe_hit(pair, *result.contact);
  return result;
}

// To be resumed with this pair.
ToiResult ToiSearch::finish_undecided(ToiStatus status, const QueuedPair& pair) {
  queue_.push(pair);
  memory_.is_unfinished = true;
  memory_.standing_time = pair_.time();
  return finish(status, pair.time);
}

// A proven time, or infinity. Only balls about the origins are not lost within a turn: while their
// steps span more than that, they carry the search.
Scalar ToiSearch::skip_turns() {
  constexpr int kSteps = 32;
  constexpr Scalar kTurn = 6.3;
  const Scalar turning = std::max(pair_.now().angular_speed_a, pair_.now().angular_speed_b);
  for (int k = 0; k < kSteps; ++k) {
    const Scalar step = internal::safe_time_of_balls(pair_.now(), a().radius, b().radius, look_);
    if (!(step * turning > kTurn)) break;
    if (step >= pair_.now().remaining) return kInfinity;
    if (!(pair_.time() + step > pair_.time())) break;
    pair_.set_time(pair_.time() + step);
  }
  return pair_.time();
}

// A proven time, or infinity. Two convex shapes need no first look while balls about their origins
// are proven apart.
Scalar ToiSearch::first_time() {
  const Scalar begin = skip_turns();
  if (begin == kInfinity || !a().tree.convex() || !b().tree.convex()) return begin;
  const Scalar step = internal::safe_time_of_balls(pair_.now(), a().radius, b().radius, look_);
  return step > 0 && step >= pair_.now().remaining ? kInfinity : begin + step;
}

// A solid that holds a part of the other shape at the begin, whatever the distance of the surfaces.
bool ToiSearch::begins_enclosed() {
  if (!options_.solid_a && !options_.solid_b) return false;
  const auto p_W = internal::find_enclosed_point(a().shape, a().motion.pose(interval_.begin),
                                                 b().shape, b().motion.pose(interval_.begin),
                                                 {options_.solid_a, options_.solid_b});
  if (!p_W) return false;
  result_.contact.emplace();
  result_.contact->p_WCa = result_.contact->p_WCb = *p_W;
  return true;
}

ToiResult ToiSearch::run() {
  queue_.clear();
  memory_.seed.count = 0;
  memory_.is_unfinished = false;
  memory_.has_resting_pair = false;
  memory_.is_looking = false;
  if (begins_enclosed()) return finish(ToiStatus::InitiallyWithinTarget, interval_.begin);
  push(first_time(), ShapeTree::kRoot, ShapeTree::kRoot);
  return resume();
}

ToiResult ToiSearch::resume() {
  // Where the bodies stood, so that all goes on with the same bits.
  if (memory_.is_unfinished) pair_.set_time(memory_.standing_time);
  memory_.is_unfinished = false;
  while (!queue_.is_empty()) {
    result_.statistics.peak_queue = std::max(result_.statistics.peak_queue, queue_.size());
    QueuedPair pair = queue_.pop();
    // A pair that goes on with its look for a nearer one was counted before.
    if (!memory_.is_looking) {
      if (const auto status = interruption_.after(result_.statistics.node_pairs)) {
        return finish_undecided(*status, pair);
      }
      ++result_.statistics.node_pairs;
    }
    const bool is_far = (pair.b & kFarFlag) != 0;
    pair.b &= ~kFarFlag;
    const bool is_opened = !is_far && !(a().tree.is_leaf(pair.a) && b().tree.is_leaf(pair.b));
    if (is_opened) fetch_parts(pair);  // while the time is set
    const bool are_boxes = is_far || is_opened;
    if (pair.time != pair_.time() && !(are_boxes && may_stand_still(pair))) {
      pair_.set_time(pair.time);
    }
    if (is_far) {
      advance(pair);
      continue;
    }
    if (is_opened) {
      open(pair);
      continue;
    }
    switch (examine_leaves(pair)) {
      case Verdict::GoOn:
        break;
      case Verdict::TooCloseAtBegin:
        return finish(ToiStatus::InitiallyWithinTarget, pair.time);
      case Verdict::Stuck:
        return finish(ToiStatus::NumericalLimit, pair.time);
      case Verdict::Interrupted:
        return finish_undecided(interruption_.status().value(), pair);
      case Verdict::Impact:
        return finish_impact(pair);
    }
  }
  return finish(ToiStatus::Separated, interval_.end);
}

}  // namespace

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  internal::ToiMemory memory;
  return ToiSearch(a, X_WA, b, X_WB, interval, options, memory).run();
}

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  internal::ToiMemory& memory = workspace.memory();
  memory.subject = {
      &a, &X_WA, &b, &X_WB, interval, options.target_distance, options.distance_tolerance};
  return ToiSearch(a, X_WA, b, X_WB, interval, options, memory).run();
}

ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace) {
  internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  internal::ToiMemory& memory = workspace.memory();
  DYOP_REQUIRE(memory.is_unfinished, "resume_time_of_impact: the workspace holds no query that ",
               "ended undecided");
  const internal::ToiSubject subject{
      &a, &X_WA, &b, &X_WB, interval, options.target_distance, options.distance_tolerance};
  DYOP_REQUIRE(memory.subject == subject, "resume_time_of_impact: shapes, motions, interval, ",
               "target and tolerance must be those of the query to be resumed");
  return ToiSearch(a, X_WA, b, X_WB, interval, options, memory).resume();
}

}  // namespace dyop
