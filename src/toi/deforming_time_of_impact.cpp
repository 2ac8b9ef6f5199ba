#include "dyop/toi/deforming_time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "hierarchy/box_direction.h"
#include "toi/deforming/deforming_sides.h"
#include "toi/interruption.h"
#include "toi/radix_queue.h"
#include "toi/toi_check.h"

namespace dyop {
namespace {

using internal::DeformingSide;
using internal::PairInstant;
using internal::QueuedPair;
using internal::RadixQueue;
using internal::RigidSide;
using internal::SafeStep;

// literal: a pair whose gap exceeds this part of its size is looked at again, at its new time,
// before it is split, as in time_of_impact of rigid shapes.
constexpr Scalar kReadvanceRatio = 0.2;

Feature mesh_feature(Feature local, const TriangleIndices& indices) {
  for (std::int32_t& vertex : local.vertices) {
    if (vertex >= 0) vertex = indices[static_cast<std::size_t>(vertex)];
  }
  return local;
}

// Best-first conservative advancement of a deforming mesh against either kind of side; the search
// of time_of_impact.cpp with other bounds.
template <typename SideB>
class DeformingSearch {
 public:
  DeformingSearch(DeformingSide& a, SideB& b, const TimeInterval& interval,
                  const ToiOptions& options);

  ToiResult run();

 private:
  enum class Verdict { GoOn, Impact, TooCloseAtBegin, Stuck };

  void set_time(Scalar t);
  SafeStep step_between(const QueuedPair& pair, const Vector3& n_W, Scalar floor,
                        bool is_leaf) const;
  SafeStep box_step(const QueuedPair& pair, Scalar* diagonal) const;
  void push(const QueuedPair& pair);
  void push_parts(const QueuedPair& pair, Scalar safe_until);
  void examine_boxes(const QueuedPair& pair);
  Verdict examine_leaves(const QueuedPair& pair);
  TriangleDistance leaf_distance(const QueuedPair& pair) const;
  Scalar closing_speed(const TriangleDistance& leaf, const QueuedPair& pair) const;
  ImpactContact make_contact(const TriangleDistance& leaf, const QueuedPair& pair) const;
  std::optional<Scalar> probe_hit(const QueuedPair& pair, const ImpactContact& contact);
  ToiResult finish(ToiStatus status, Scalar t_safe);
  ToiResult finish_impact(const QueuedPair& pair);

  DeformingSide& a_;
  SideB& b_;
  const TimeInterval interval_;
  const ToiOptions& options_;
  const Scalar lost_;   // at most this far apart at the begin: nothing can be guaranteed
  const Scalar floor_;  // the distance that is not undercut
  const Scalar near_;   // at most this far apart and closing: impact
  PairInstant now_;     // only noise, horizon and remaining are used
  Scalar time_ = 0;
  RadixQueue queue_;
  internal::Interruption interruption_;
  ToiResult result_;
};

template <typename SideB>
DeformingSearch<SideB>::DeformingSearch(DeformingSide& a, SideB& b, const TimeInterval& interval,
                                        const ToiOptions& options)
    : a_(a),
      b_(b),
      interval_(interval),
      options_(options),
      lost_(options.target_distance + kLostFraction * options.distance_tolerance),
      floor_(options.target_distance + kFloorFraction * options.distance_tolerance),
      near_(options.target_distance + options.distance_tolerance),
      interruption_(options) {
  now_.noise = kStepNoise * (a_.size() + b_.size());
  set_time(interval.begin);
}

template <typename SideB>
void DeformingSearch<SideB>::set_time(Scalar t) {
  a_.set_time(t);
  b_.set_time(t);
  time_ = t;
  now_.remaining = std::max(0.0, interval_.end - t);
  now_.horizon = std::min(now_.remaining, b_.smooth_until(t) - t);
  b_.set_horizon(t, std::min(interval_.end, t + now_.horizon));
}

template <typename SideB>
SafeStep DeformingSearch<SideB>::step_between(const QueuedPair& pair, const Vector3& n_W,
                                              Scalar floor, bool is_leaf) const {
  const auto step_of = [&](const auto& support_a, const auto& support_b) {
    const auto gap_at = [&](Scalar u, Scalar q) {
      return -support_b.at(u, q) - support_a.at(u, q) - floor;
    };
    return internal::coupled_step(now_, b_.rest(pair.b, support_b), gap_at);
  };
  SafeStep step = is_leaf
                      ? step_of(a_.triangle_support(pair.a, n_W), b_.triangle_support(pair.b, -n_W))
                      : step_of(a_.box_support(pair.a, n_W), b_.box_support(pair.b, -n_W));
  if (step.gap > 0 && step.time < now_.remaining) {
    // Holds across jumps of the rigid body's twist, where accelerations are infinite.
    const Scalar speed = a_.speed(pair.a) + b_.speed(pair.b);
    const Scalar by_speed = speed >= 0 ? step.gap / speed : 0;  // NaN (infinite bound): no step
    step.time = std::max(step.time, by_speed);
  }
  if (step.gap > 0 && step.time >= now_.remaining) step.time = kInfinity;
  return step;
}

template <typename SideB>
SafeStep DeformingSearch<SideB>::box_step(const QueuedPair& pair, Scalar* diagonal) const {
  const OrientedBox box_a = a_.box_W(pair.a);
  const OrientedBox box_b = b_.box_W(pair.b);
  *diagonal = box_a.half_extents.norm() + box_b.half_extents.norm();
  return step_between(pair, internal::separating_direction(box_a, box_b), floor_, false);
}

// Drops a pair that is safe to the end.
template <typename SideB>
void DeformingSearch<SideB>::push(const QueuedPair& pair) {
  if (pair.time != kInfinity) queue_.push(pair);
}

// Splits the larger box. `safe_until` is what the pair itself is proven for.
template <typename SideB>
void DeformingSearch<SideB>::push_parts(const QueuedPair& pair, Scalar safe_until) {
  const bool splits_a = !a_.is_leaf(pair.a) &&
                        (b_.is_leaf(pair.b) || a_.box_W(pair.a).half_extents.squaredNorm() >=
                                                   b_.box_W(pair.b).half_extents.squaredNorm());
  const int count = splits_a ? a_.part_count(pair.a) : b_.part_count(pair.b);
  for (int i = 0; i < count; ++i) {
    const QueuedPair next{time_, splits_a ? a_.part(pair.a, i) : pair.a,
                          splits_a ? pair.b : b_.part(pair.b, i)};
    Scalar diagonal = 0;
    ++result_.statistics.box_tests;
    const SafeStep step = box_step(next, &diagonal);
    push({std::max(safe_until, time_ + step.time), next.a, next.b});
  }
}

template <typename SideB>
void DeformingSearch<SideB>::examine_boxes(const QueuedPair& pair) {
  Scalar diagonal = 0;
  ++result_.statistics.box_tests;
  const SafeStep step = box_step(pair, &diagonal);
  const Scalar safe_until = time_ + step.time;
  if (safe_until == kInfinity) return;
  if (step.gap > kReadvanceRatio * diagonal && safe_until > time_) {
    push({safe_until, pair.a, pair.b});
  } else {
    push_parts(pair, safe_until);
  }
}

template <typename SideB>
TriangleDistance DeformingSearch<SideB>::leaf_distance(const QueuedPair& pair) const {
  TriangleDistance leaf = triangle_distance(a_.triangle_W(pair.a), b_.triangle_W(pair.b));
  leaf.lower = std::max(0.0, leaf.lower - now_.noise);
  leaf.upper += now_.noise;
  return leaf;
}

template <typename SideB>
Scalar DeformingSearch<SideB>::closing_speed(const TriangleDistance& leaf,
                                             const QueuedPair& pair) const {
  return leaf.nhat_AB.dot(a_.velocity_at(pair.a, leaf.p_a) - b_.velocity_at(pair.b, leaf.p_b));
}

template <typename SideB>
typename DeformingSearch<SideB>::Verdict DeformingSearch<SideB>::examine_leaves(
    const QueuedPair& pair) {
  ++result_.statistics.leaf_tests;
  const TriangleDistance leaf = leaf_distance(pair);
  if (time_ == interval_.begin && !(leaf.lower > lost_)) {
    result_.contact = make_contact(leaf, pair);
    // Bounds wider than the tolerance do not tell near from far; nor does NaN.
    return leaf.upper <= near_ ? Verdict::TooCloseAtBegin : Verdict::Stuck;
  }
  const bool is_near = !(leaf.upper > near_ + now_.noise);
  const Scalar speeds = a_.speed(pair.a) + b_.speed(pair.b);
  if (is_near && closing_speed(leaf, pair) > kPoseNoise * speeds) {
    result_.contact = make_contact(leaf, pair);
    return Verdict::Impact;
  }
  // Near and opening: on until the gap may have lost an eighth of the room that is left.
  const Scalar room = std::max(2 * now_.noise, (leaf.lower - lost_) / 8);
  const Scalar returning = std::max(lost_, leaf.lower - room);
  const SafeStep step = step_between(pair, leaf.nhat_AB, is_near ? returning : floor_, true);
  const Scalar next = time_ + step.time;
  if (!(next > time_)) {
    result_.contact = make_contact(leaf, pair);
    return is_near ? Verdict::Impact : Verdict::Stuck;
  }
  push({next, pair.a, pair.b});
  return Verdict::GoOn;
}

template <typename SideB>
ImpactContact DeformingSearch<SideB>::make_contact(const TriangleDistance& leaf,
                                                   const QueuedPair& pair) const {
  const std::int32_t triangle_a = a_.triangle(pair.a);
  const std::int32_t triangle_b = b_.triangle(pair.b);
  ImpactContact contact;
  contact.lower = leaf.lower;
  contact.upper = leaf.upper;
  contact.p_WCa = leaf.p_a;
  contact.p_WCb = leaf.p_b;
  contact.nhat_AB_W = leaf.nhat_AB;
  contact.closing_speed = closing_speed(leaf, pair);
  contact.feature_a =
      mesh_feature(leaf.feature_a, a_.triangles()[static_cast<std::size_t>(triangle_a)]);
  contact.feature_b =
      mesh_feature(leaf.feature_b, b_.triangles()[static_cast<std::size_t>(triangle_b)]);
  contact.triangle_a = triangle_a;
  contact.triangle_b = triangle_b;
  return contact;
}

// Goes on along the motion in doubling steps until the pair in contact is proven below the floor.
template <typename SideB>
std::optional<Scalar> DeformingSearch<SideB>::probe_hit(const QueuedPair& pair,
                                                        const ImpactContact& contact) {
  constexpr int kProbes = 12;
  if (!(contact.closing_speed > 0)) return std::nullopt;
  const Scalar begin = time_;
  // At the begin the gap may be below the floor already.
  const Scalar way = std::max(contact.upper - floor_, options_.distance_tolerance / 8);
  // literal: a little longer than to the floor, so that the first probe is below it as a rule.
  Scalar step = 1.25 * way / contact.closing_speed;
  for (int probe = 0; probe < kProbes && begin + step <= interval_.end; ++probe, step *= 2) {
    if (!(begin + step > begin)) continue;
    set_time(begin + step);
    const TriangleDistance leaf = leaf_distance(pair);
    if (leaf.upper < floor_ || leaf.is_overlapping) return time_;
  }
  return std::nullopt;
}

template <typename SideB>
ToiResult DeformingSearch<SideB>::finish(ToiStatus status, Scalar t_safe) {
  set_time(t_safe);
  result_.status = status;
  result_.t_safe = t_safe;
  // Of a pair at the begin that waited for others to be looked at.
  if (status == ToiStatus::BudgetExhausted || status == ToiStatus::Cancelled) {
    result_.contact.reset();
  }
  result_.rounding_allowance = now_.noise;
  result_.X_WB = b_.pose();
  return std::move(result_);
}

template <typename SideB>
ToiResult DeformingSearch<SideB>::finish_impact(const QueuedPair& pair) {
  result_.t_hit = probe_hit(pair, *result_.contact);
  return finish(ToiStatus::Impact, pair.time);
}

template <typename SideB>
ToiResult DeformingSearch<SideB>::run() {
  queue_.push({interval_.begin, 0, 0});
  // A pair in contact at the begin: there nothing is proven of the others, which may be too close.
  std::optional<QueuedPair> begin_contact;
  while (!queue_.is_empty()) {
    result_.statistics.peak_queue = std::max(result_.statistics.peak_queue, queue_.size());
    const QueuedPair pair = queue_.pop();
    if (begin_contact && pair.time > interval_.begin) break;
    if (const auto status = interruption_.after(result_.statistics.node_pairs))
      return finish(*status, pair.time);
    ++result_.statistics.node_pairs;
    if (pair.time != time_) set_time(pair.time);
    if (!a_.is_leaf(pair.a) || !b_.is_leaf(pair.b)) {
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
        if (pair.time > interval_.begin) return finish_impact(pair);
        if (!begin_contact) begin_contact = pair;
        break;
    }
  }
  if (begin_contact) {
    result_.contact = make_contact(leaf_distance(*begin_contact), *begin_contact);
    return finish_impact(*begin_contact);
  }
  return finish(ToiStatus::Separated, interval_.end);
}

void require_options(const TimeInterval& interval, const ToiOptions& options) {
  require_valid(interval, "time_of_impact: interval");
  internal::require_valid_options(options);
  DYOP_REQUIRE(!options.solid_a && !options.solid_b,
               "time_of_impact: deforming meshes are surfaces, solid_a and solid_b must be false");
}

}  // namespace

ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options) {
  require_options(interval, options);
  DeformingSide side_a(a, interval);
  DeformingSide side_b(b, interval);
  return DeformingSearch(side_a, side_b, interval, options).run();
}

ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  require_options(interval, options);
  require_defined(X_WB, interval, "time_of_impact: the motion of B");
  DeformingSide side_a(a, interval);
  RigidSide side_b(b, X_WB, interval);
  return DeformingSearch(side_a, side_b, interval, options).run();
}

}  // namespace dyop
