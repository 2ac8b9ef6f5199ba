#include "dyop/toi/time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "distance/box_gap.h"
#include "distance/piece_distance.h"
#include "distance/shape_tree.h"
#include "dyop/core/error.h"
#include "dyop/core/tolerance.h"
#include "toi/motion_bounds.h"
#include "toi/safe_step.h"

namespace dyop {
namespace {

using internal::BodyInstant;
using internal::MotionBounds;
using internal::PairInstant;
using internal::PieceDistance;
using internal::SafeStep;
using internal::ShapeTree;

// A pair of tree nodes and the time before which they are proven more than the floor apart.
struct QueuedPair {
  Scalar time;
  std::int32_t a;
  std::int32_t b;
};

// For std::push_heap: the earliest on top. Numbers break ties, so that the order never depends on
// how the heap came to be.
bool is_later(const QueuedPair& x, const QueuedPair& y) {
  if (x.time != y.time) return x.time > y.time;
  return x.a != y.a ? x.a < y.a : x.b < y.b;
}

// literal: a pair whose gap exceeds this part of its size is looked at again, at its new time,
// before it is split; wide trees of pairs far apart explode without it.
constexpr Scalar kReadvanceRatio = 0.2;

// How often the clock and the stop token are looked at, in node pairs.
constexpr std::int64_t kPollInterval = 64;

// One of the two bodies of a query: what it is and how it moves.
struct MovingShape {
  MovingShape(const Shape& the_shape, const Motion& the_motion, const TimeInterval& interval)
      : shape(the_shape), tree(the_shape), motion(the_motion), bounds(the_motion, interval) {}

  BodyInstant at(Scalar t) const {
    const RigidPose X_WB = motion.pose(t);
    const Twist twist = motion.twist(t);
    return {X_WB.rotation(), X_WB.translation(), twist.v_WB, twist.w_WB};
  }

  const Shape& shape;
  ShapeTree tree;
  const Motion& motion;
  MotionBounds bounds;
};

Vector3 point_velocity(const BodyInstant& body, const Vector3& p_W) {
  return body.v_WB + body.w_WB.cross(p_W - body.p_WB);
}

Scalar node_radius(const OrientedBox& box) {
  return box.center.norm() + box.half_extents.norm();
}

// Best-first conservative advancement of one pair of shapes.
class ToiSearch {
 public:
  ToiSearch(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
            const TimeInterval& interval, const ToiOptions& options);

  ToiResult run();

 private:
  enum class Verdict { GoOn, Impact, TooCloseAtBegin, Stuck };

  Scalar rounding_allowance() const;
  void set_time(Scalar t);
  void set_horizon(Scalar t);
  SafeStep box_step(std::int32_t node_a, std::int32_t node_b, Scalar* diagonal) const;
  SafeStep leaf_step(const PieceDistance& piece, const QueuedPair& pair, Scalar floor) const;
  void push(Scalar time, std::int32_t node_a, std::int32_t node_b);
  void push_children(std::int32_t node_a, std::int32_t node_b, Scalar safe_until);
  void examine_boxes(const QueuedPair& pair);
  Verdict examine_leaves(const QueuedPair& pair);
  bool is_closing(const PieceDistance& piece) const;
  ImpactContact make_contact(const PieceDistance& piece, const QueuedPair& pair) const;
  std::optional<Scalar> probe_hit(const QueuedPair& pair, const ImpactContact& contact);
  ToiResult finish(ToiStatus status, Scalar t_safe);
  std::optional<ToiStatus> interruption() const;

  const TimeInterval interval_;
  const ToiOptions& options_;
  MovingShape a_;
  MovingShape b_;
  const Scalar noise_;
  const Scalar lost_;   // at most this far apart at the begin: nothing can be guaranteed
  const Scalar floor_;  // the distance that is never undercut
  const Scalar near_;   // at most this far apart and closing: impact

  PairInstant now_;
  RigidPose X_AB_;
  Scalar time_ = 0;
  std::vector<QueuedPair> queue_;
  ToiResult result_;
};

ToiSearch::ToiSearch(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                     const TimeInterval& interval, const ToiOptions& options)
    : interval_(interval),
      options_(options),
      a_(a, X_WA, interval),
      b_(b, X_WB, interval),
      noise_(rounding_allowance()),
      lost_(options.target_distance + kLostFraction * options.distance_tolerance),
      floor_(options.target_distance + kFloorFraction * options.distance_tolerance),
      near_(options.target_distance + options.distance_tolerance) {
  now_.noise = noise_;
  set_time(interval.begin);
}

// Coordinates are as large as the origins get in the interval plus the radii; a time off by one
// rounding moves a point by its speed times that.
Scalar ToiSearch::rounding_allowance() const {
  const auto size_of = [&](const MovingShape& body) {
    const TwistBound& bound = body.bounds.whole();
    const Scalar radius = body.shape.bounding_radius();
    const Scalar origin = body.motion.pose(interval_.begin).translation().norm() +
                          bound.linear_speed * interval_.length();
    const Scalar largest_time = std::max(std::abs(interval_.begin), std::abs(interval_.end));
    return origin + radius + (bound.linear_speed + bound.angular_speed * radius) * largest_time;
  };
  return kPoseNoise * (size_of(a_) + size_of(b_));
}

void ToiSearch::set_time(Scalar t) {
  now_.a = a_.at(t);
  now_.b = b_.at(t);
  time_ = t;
  X_AB_ = RigidPose::from_trusted(now_.a.R_WB.transpose() * now_.b.R_WB,
                                  now_.a.R_WB.transpose() * (now_.b.p_WB - now_.a.p_WB));
  set_horizon(t);
}

void ToiSearch::set_horizon(Scalar t) {
  now_.remaining = std::max(0.0, interval_.end - t);
  const Scalar smooth_end = std::min(a_.motion.smooth_until(t), b_.motion.smooth_until(t));
  now_.horizon = std::min(now_.remaining, smooth_end - t);
  const Scalar end = std::min(interval_.end, t + now_.horizon);
  const TwistBound near_a = a_.bounds.over(t, end);
  const TwistBound near_b = b_.bounds.over(t, end);
  now_.linear_acceleration = near_a.linear_acceleration + near_b.linear_acceleration;
  now_.angular_acceleration_a = near_a.angular_acceleration;
  now_.angular_acceleration_b = near_b.angular_acceleration;
  now_.linear_speed = a_.bounds.whole().linear_speed + b_.bounds.whole().linear_speed;
  now_.angular_speed_a = a_.bounds.whole().angular_speed;
  now_.angular_speed_b = b_.bounds.whole().angular_speed;
}

// Safe step of two nodes from the current time.
SafeStep ToiSearch::box_step(std::int32_t node_a, std::int32_t node_b, Scalar* diagonal) const {
  const OrientedBox& box_a = a_.tree.box(node_a);
  const OrientedBox& box_b = b_.tree.box(node_b);
  *diagonal = box_a.half_extents.norm() + box_b.half_extents.norm();
  const internal::BoxGap gap = internal::box_gap(box_a, box_b, X_AB_, noise_);
  if (!(gap.gap > floor_)) return {};
  return internal::safe_step(now_, box_a, node_radius(box_a), box_b, node_radius(box_b),
                             now_.a.R_WB * gap.nhat_AB_A, floor_);
}

SafeStep ToiSearch::leaf_step(const PieceDistance& piece, const QueuedPair& pair,
                              Scalar floor) const {
  const Scalar radius_a = node_radius(a_.tree.box(pair.a));
  const Scalar radius_b = node_radius(b_.tree.box(pair.b));
  const Vector3 n_W = now_.a.R_WB * piece.nhat_AB_A;
  const auto step = [&](const auto& piece_a, const auto& piece_b) {
    return internal::safe_step(now_, piece_a, radius_a, piece_b, radius_b, n_W, floor);
  };
  const auto with_b = [&](const auto& piece_a) {
    return b_.tree.mesh() ? step(piece_a, b_.tree.mesh()->triangle(b_.tree.triangle(pair.b)))
                          : step(piece_a, *b_.tree.convex());
  };
  return a_.tree.mesh() ? with_b(a_.tree.mesh()->triangle(a_.tree.triangle(pair.a)))
                        : with_b(*a_.tree.convex());
}

void ToiSearch::push(Scalar time, std::int32_t node_a, std::int32_t node_b) {
  if (time == kInfinity) return;  // proven apart to the end
  queue_.push_back({time, node_a, node_b});
  std::push_heap(queue_.begin(), queue_.end(), is_later);
}

// Splits the larger node. `safe_until` is what the pair itself is proven for.
void ToiSearch::push_children(std::int32_t node_a, std::int32_t node_b, Scalar safe_until) {
  const bool split_a =
      !a_.tree.is_leaf(node_a) &&
      (b_.tree.is_leaf(node_b) || a_.tree.box(node_a).half_extents.squaredNorm() >=
                                      b_.tree.box(node_b).half_extents.squaredNorm());
  const std::int32_t first = split_a ? a_.tree.first_child(node_a) : b_.tree.first_child(node_b);
  for (std::int32_t child = first; child < first + 2; ++child) {
    const std::int32_t child_a = split_a ? child : node_a;
    const std::int32_t child_b = split_a ? node_b : child;
    Scalar diagonal = 0;
    ++result_.statistics.box_tests;
    const SafeStep step = box_step(child_a, child_b, &diagonal);
    push(std::max(safe_until, time_ + step.time), child_a, child_b);
  }
}

void ToiSearch::examine_boxes(const QueuedPair& pair) {
  Scalar diagonal = 0;
  ++result_.statistics.box_tests;
  const SafeStep step = box_step(pair.a, pair.b, &diagonal);
  const Scalar safe_until = time_ + step.time;
  if (safe_until == kInfinity) return;
  if (step.gap > kReadvanceRatio * diagonal && safe_until > time_) {
    push(safe_until, pair.a, pair.b);
  } else {
    push_children(pair.a, pair.b, safe_until);
  }
}

bool ToiSearch::is_closing(const PieceDistance& piece) const {
  const Vector3 n_W = now_.a.R_WB * piece.nhat_AB_A;
  const Vector3 p_WCa = now_.a.R_WB * piece.p_ACa + now_.a.p_WB;
  const Vector3 p_WCb = now_.a.R_WB * piece.p_ACb + now_.a.p_WB;
  const Vector3 velocity_a = point_velocity(now_.a, p_WCa);
  const Vector3 velocity_b = point_velocity(now_.b, p_WCb);
  const Scalar speeds = now_.a.v_WB.norm() + now_.b.v_WB.norm() +
                        now_.a.w_WB.norm() * a_.shape.bounding_radius() +
                        now_.b.w_WB.norm() * b_.shape.bounding_radius();
  return n_W.dot(velocity_b - velocity_a) < -kPoseNoise * speeds;
}

ToiSearch::Verdict ToiSearch::examine_leaves(const QueuedPair& pair) {
  ++result_.statistics.leaf_tests;
  const PieceDistance piece =
      internal::piece_distance(a_.tree, pair.a, b_.tree, pair.b, X_AB_, noise_);
  // What lies this close at the begin was never proven apart. Later it cannot be there but for
  // rounding, and the time it is at was proven safe.
  if (time_ == interval_.begin && !(piece.lower > lost_)) {
    result_.contact = make_contact(piece, pair);
    // Bounds wider than the tolerance do not tell near from far; nor does NaN.
    return piece.upper <= near_ ? Verdict::TooCloseAtBegin : Verdict::Stuck;
  }
  const bool is_near = !(piece.upper > near_ + noise_);
  if (is_near && is_closing(piece)) {
    result_.contact = make_contact(piece, pair);
    return Verdict::Impact;
  }
  // Near and opening: go on until the gap may have lost an eighth of the room that is left, to be
  // looked at again. So a pair that hops in the band keeps its height nearly, and always has room.
  const Scalar room = std::max(2 * noise_, (piece.lower - lost_) / 8);
  const Scalar returning = std::max(lost_, piece.lower - room);
  const SafeStep step = leaf_step(piece, pair, is_near ? returning : floor_);
  const Scalar next = time_ + step.time;
  if (!(next > time_)) {
    result_.contact = make_contact(piece, pair);
    return is_near ? Verdict::Impact : Verdict::Stuck;
  }
  push(next, pair.a, pair.b);
  return Verdict::GoOn;
}

ImpactContact ToiSearch::make_contact(const PieceDistance& piece, const QueuedPair& pair) const {
  const RigidPose X_WA = RigidPose::from_trusted(now_.a.R_WB, now_.a.p_WB);
  ImpactContact contact;
  contact.distance_lower = piece.lower;
  contact.distance_upper = piece.upper;
  contact.p_WCa = X_WA * piece.p_ACa;
  contact.p_WCb = X_WA * piece.p_ACb;
  contact.nhat_AB_W = X_WA.rotation() * piece.nhat_AB_A;
  contact.closing_speed = contact.nhat_AB_W.dot(point_velocity(now_.a, contact.p_WCa) -
                                                point_velocity(now_.b, contact.p_WCb));
  contact.feature_a = piece.feature_a;
  contact.feature_b = piece.feature_b;
  contact.triangle_a = internal::triangle_number(a_.tree, pair.a);
  contact.triangle_b = internal::triangle_number(b_.tree, pair.b);
  contact.pivot_W = (contact.p_WCa + contact.p_WCb) / 2;
  return contact;
}

// Goes on along the motion in doubling steps until the pair in contact is proven below the floor.
std::optional<Scalar> ToiSearch::probe_hit(const QueuedPair& pair, const ImpactContact& contact) {
  constexpr int kProbes = 12;
  if (!(contact.closing_speed > 0)) return std::nullopt;
  const Scalar begin = time_;
  Scalar step = (contact.distance_upper - floor_) / contact.closing_speed;
  for (int probe = 0; probe < kProbes && begin + step <= interval_.end; ++probe, step *= 2) {
    set_time(begin + step);
    const PieceDistance piece =
        internal::piece_distance(a_.tree, pair.a, b_.tree, pair.b, X_AB_, noise_);
    if (piece.upper < floor_ || piece.is_overlapping) return time_;
  }
  return std::nullopt;
}

std::optional<ToiStatus> ToiSearch::interruption() const {
  if (result_.statistics.node_pairs >= options_.max_node_pairs) return ToiStatus::BudgetExhausted;
  if (result_.statistics.node_pairs % kPollInterval != 0) return std::nullopt;
  if (options_.stop.stop_requested()) return ToiStatus::Cancelled;
  if (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline) {
    return ToiStatus::BudgetExhausted;
  }
  return std::nullopt;
}

ToiResult ToiSearch::finish(ToiStatus status, Scalar t_safe) {
  result_.status = status;
  result_.t_safe = t_safe;
  result_.rounding_allowance = noise_;
  result_.X_WA = a_.motion.pose(t_safe);
  result_.X_WB = b_.motion.pose(t_safe);
  return std::move(result_);
}

ToiResult ToiSearch::run() {
  queue_.push_back({interval_.begin, 0, 0});
  while (!queue_.empty()) {
    result_.statistics.peak_queue =
        std::max(result_.statistics.peak_queue, static_cast<std::int64_t>(queue_.size()));
    std::pop_heap(queue_.begin(), queue_.end(), is_later);
    const QueuedPair pair = queue_.back();
    queue_.pop_back();
    if (const auto status = interruption()) return finish(*status, pair.time);
    ++result_.statistics.node_pairs;
    if (pair.time != time_) set_time(pair.time);
    if (!a_.tree.is_leaf(pair.a) || !b_.tree.is_leaf(pair.b)) {
      examine_boxes(pair);
      continue;
    }
    switch (examine_leaves(pair)) {
      case Verdict::GoOn:
        break;
      case Verdict::TooCloseAtBegin:
        return finish(ToiStatus::InitiallyWithinTarget, pair.time);
      case Verdict::Stuck:
        return finish(ToiStatus::NumericalLimit, pair.time);
      case Verdict::Impact:
        result_.t_hit = probe_hit(pair, *result_.contact);
        return finish(ToiStatus::Impact, pair.time);
    }
  }
  return finish(ToiStatus::Separated, interval_.end);
}

}  // namespace

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  require_valid(interval, "time_of_impact: interval");
  require_defined(X_WA, interval, "time_of_impact: the motion of A");
  require_defined(X_WB, interval, "time_of_impact: the motion of B");
  DYOP_REQUIRE(options.target_distance >= 0 && options.target_distance < kInfinity,
               "time_of_impact: target_distance must be finite and >= 0, not ",
               options.target_distance);
  DYOP_REQUIRE(options.distance_tolerance > 0 && options.distance_tolerance < kInfinity,
               "time_of_impact: distance_tolerance must be finite and > 0, not ",
               options.distance_tolerance);
  DYOP_REQUIRE(options.max_node_pairs > 0, "time_of_impact: max_node_pairs must be > 0, not ",
               options.max_node_pairs);
  return ToiSearch(a, X_WA, b, X_WB, interval, options).run();
}

}  // namespace dyop
