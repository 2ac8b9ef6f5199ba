// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/least_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/rigid/motion_bounds.h"
#include "toi/toi_check.h"

namespace dyop {
namespace {

// The distance is first sampled at the ends of this many equal parts.
constexpr int kParts = 8;
// Limit on the steps of a descent to a minimum. Each removes a third of the bracket.
constexpr int kDescentSteps = 60;
// Limit on proofs that fail by finding something nearer, before the tolerance is widened.
constexpr int kProofs = 64;

// Finds a nearest approach, and proves that there is no nearer one.
class LeastDistanceSearch {
 public:
  LeastDistanceSearch(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                      const TimeInterval& interval, const LeastDistanceOptions& options);

  LeastDistanceResult run();

 private:
  Scalar part_end(int part) const {
    if (part + 1 == kParts) return interval_.end;
    return std::min(interval_.begin + interval_.length() * (part + 1) / kParts, interval_.end);
  }
  Scalar measure(Scalar t);
  void sample();
  void descend(Scalar low, Scalar high);
  void descend_from(Scalar t);
  bool prove();
  ToiResult ask(Scalar target, Scalar tolerance);
  void take_unproven(const ToiResult& toi);
  Scalar tolerance() const { return toi_internal::tolerance_of(options_, result_); }
  Scalar speed_over(const TimeInterval& part) const;
  LeastDistanceResult finish(LeastDistanceStatus status);

  const Shape& a_;
  const Motion& X_WA_;
  const Shape& b_;
  const Motion& X_WB_;
  const TimeInterval interval_;
  const LeastDistanceOptions& options_;
  const Scalar radius_a_;
  const Scalar radius_b_;
  DistanceCache cache_;
  ToiWorkspace workspace_;
  std::array<Scalar, kParts> part_lower_{};  // lower bound from speeds alone, over each part
  // Proven on [begin, proven_until_]: the distance is at least floor_.
  Scalar floor_ = kInfinity;
  Scalar proven_until_;
  Scalar widening_ = 1;  // factor on the tolerance, raised when proofs fail
  LeastDistanceResult result_;
};

LeastDistanceSearch::LeastDistanceSearch(const Shape& a, const Motion& X_WA, const Shape& b,
                                         const Motion& X_WB, const TimeInterval& interval,
                                         const LeastDistanceOptions& options)
    : a_(a),
      X_WA_(X_WA),
      b_(b),
      X_WB_(X_WB),
      interval_(interval),
      options_(options),
      radius_a_(toi_internal::radius_in(a, X_WA, b, X_WB, interval)),
      radius_b_(toi_internal::radius_in(b, X_WB, a, X_WA, interval)),
      proven_until_(interval.begin) {
  result_.rounding_allowance =
      kStepNoise *
      (toi_internal::largest_coordinate(X_WA, X_WA.twist_bound(interval), radius_a_, interval) +
       toi_internal::largest_coordinate(X_WB, X_WB.twist_bound(interval), radius_b_, interval));
}

// The distance at one time, up to rounding; keeps the least one.
Scalar LeastDistanceSearch::measure(Scalar t) {
  ++result_.distance_queries;
  const RigidPose X_WA = X_WA_.pose(t);
  const RigidPose X_WB = X_WB_.pose(t);
  DistanceOptions options;
  options.solid_a = options_.solid_a;
  options.solid_b = options_.solid_b;
  const DistanceResult found = distance(a_, X_WA, b_, X_WB, options, cache_);
  const Scalar upper = found.upper + result_.rounding_allowance;
  if (upper < result_.upper) {
    result_.upper = upper;
    result_.t_upper = t;
    result_.nearest = found;
    result_.X_WA = X_WA;
    result_.X_WB = X_WB;
  }
  return found.lower;
}

// Bound on the rate at which the distance changes.
Scalar LeastDistanceSearch::speed_over(const TimeInterval& part) const {
  const TwistBound a = X_WA_.twist_bound(part);
  const TwistBound b = X_WB_.twist_bound(part);
  return a.linear_speed + b.linear_speed + a.angular_speed * radius_a_ +
         b.angular_speed * radius_b_;
}

// Within a part the distance falls below that at either end by no more than the speed allows.
void LeastDistanceSearch::sample() {
  Scalar begin = interval_.begin;
  Scalar before = measure(begin);
  for (int i = 0; i < kParts; ++i) {
    const Scalar end = part_end(i);
    const Scalar after = end > begin ? measure(end) : before;
    const Scalar change = end > begin ? speed_over({begin, end}) * (end - begin) : 0;
    const Scalar lower = (before + after - change) / 2 - result_.rounding_allowance;
    part_lower_[std::size_t(i)] = lower > 0 ? lower : 0;  // NaN proves nothing
    before = after;
    begin = end;
  }
}

// Golden section search.
void LeastDistanceSearch::descend(Scalar low, Scalar high) {
  constexpr Scalar kGolden = 0.3819660112501051;
  Scalar t1 = low + kGolden * (high - low);
  Scalar t2 = high - kGolden * (high - low);
  Scalar d1 = measure(t1);
  Scalar d2 = measure(t2);
  Scalar d_low = measure(low);
  Scalar d_high = measure(high);
  for (int step = 0; step < kDescentSteps && low < t1 && t1 < t2 && t2 < high; ++step) {
    // The minimum is below its neighbours by no more than they rise: a quarter of the tolerance
    // leaves enough for the proof.
    if (std::max(d_low, d_high) - std::min(d1, d2) <= tolerance() / 4) return;
    if (d1 <= d2) {
      high = t2;
      d_high = d2;
      t2 = t1;
      d2 = d1;
      t1 = low + kGolden * (high - low);
      d1 = measure(t1);
    } else {
      low = t1;
      d_low = d1;
      t1 = t2;
      d1 = d2;
      t2 = high - kGolden * (high - low);
      d2 = measure(t2);
    }
  }
}

// Follows a slope down that was found at t; everything before t is proven.
void LeastDistanceSearch::descend_from(Scalar t) {
  Scalar low = t;
  Scalar step = interval_.length() / (64 * kParts);
  for (Scalar lowest = measure(t); t < interval_.end; step *= 2) {
    const Scalar next = std::min(t + step, interval_.end);
    const Scalar there = next > t ? measure(next) : lowest;
    if (!(there < lowest)) {
      descend(low, next);
      return;
    }
    low = t;
    t = next;
    lowest = there;
  }
}

ToiResult LeastDistanceSearch::ask(Scalar target, Scalar tolerance) {
  ToiOptions options;
  options.target_distance = target;
  options.distance_tolerance = tolerance;
  options.max_node_pairs = options_.max_node_pairs - result_.statistics.node_pairs;
  options.deadline = options_.deadline;
  options.stop = options_.stop;
  options.solid_a = options_.solid_a;
  options.solid_b = options_.solid_b;
  const ToiResult toi =
      time_of_impact(a_, X_WA_, b_, X_WB_, {proven_until_, interval_.end}, options, workspace_);
  ToiStatistics& sum = result_.statistics;
  sum.box_tests += toi.statistics.box_tests;
  sum.leaf_tests += toi.statistics.leaf_tests;
  sum.node_pairs += toi.statistics.node_pairs;
  sum.peak_queue = std::max(sum.peak_queue, toi.statistics.peak_queue);
  const bool is_proven = toi.status == ToiStatus::Separated || toi.t_safe > proven_until_;
  if (is_proven && toi.status != ToiStatus::InitiallyWithinTarget) {
    floor_ = std::min(floor_, target + tolerance / 4 - toi.rounding_allowance);
    proven_until_ = toi.t_safe;
  }
  return toi;
}

// Examines the time at which a proof failed.
void LeastDistanceSearch::take_unproven(const ToiResult& toi) {
  const Scalar before = result_.upper;
  measure(toi.t_safe);
  if (toi.t_hit) measure(*toi.t_hit);
  if (result_.upper < before) descend_from(toi.t_safe);
}

// One attempt; returns true if everything is proven. A failed proof has found something nearer, or
// rounding stops it.
bool LeastDistanceSearch::prove() {
  const Scalar slack = widening_ * tolerance();
  const Scalar below = result_.upper - slack;
  if (!(below > 0)) {
    floor_ = 0;
    proven_until_ = interval_.end;
    return true;
  }
  const Scalar target = std::min(below, options_.max_distance);
  const Scalar before = result_.upper;
  const ToiResult toi = ask(target, slack / 2);
  switch (toi.status) {
    case ToiStatus::Separated:
      return true;
    case ToiStatus::Impact:
    case ToiStatus::InitiallyWithinTarget:
    case ToiStatus::NumericalLimit:
      take_unproven(toi);
      break;
    case ToiStatus::BudgetExhausted:
      result_.status = LeastDistanceStatus::BudgetExhausted;
      break;
    case ToiStatus::Cancelled:
    case ToiStatus::NotRun:
      result_.status = LeastDistanceStatus::Cancelled;
      break;
  }
  const bool is_nearer = result_.upper <= before - slack / 4;
  if (toi.status == ToiStatus::NumericalLimit || !is_nearer) widening_ *= 2;
  return false;
}

LeastDistanceResult LeastDistanceSearch::finish(LeastDistanceStatus status) {
  Scalar lower = kInfinity;
  for (int i = 0; i < kParts; ++i) {
    const bool is_proven = part_end(i) <= proven_until_;
    const Scalar by_speed = part_lower_[std::size_t(i)];
    lower = std::min(lower, is_proven ? std::max(by_speed, floor_) : by_speed);
  }
  result_.lower = std::clamp(lower, 0.0, result_.upper);
  result_.status = status;
  return std::move(result_);
}

LeastDistanceResult LeastDistanceSearch::run() {
  sample();
  const Scalar part = interval_.length() / kParts;
  if (part > 0 && result_.upper < options_.max_distance + part * speed_over(interval_)) {
    descend(std::max(interval_.begin, result_.t_upper - part),
            std::min(interval_.end, result_.t_upper + part));
  }
  for (int proofs = 0; !prove(); ++proofs) {
    if (result_.status != LeastDistanceStatus::NotRun) return finish(result_.status);
    if (result_.statistics.node_pairs >= options_.max_node_pairs) {
      return finish(LeastDistanceStatus::BudgetExhausted);
    }
    if (proofs >= kProofs) widening_ *= 2;
  }
  const Scalar allowed = tolerance();
  LeastDistanceResult result = finish(LeastDistanceStatus::Bounded);
  if (result.lower > options_.max_distance) {
    result.status = LeastDistanceStatus::FartherThanMaxDistance;
  } else if (result.upper - result.lower > allowed) {
    result.status = LeastDistanceStatus::NumericalLimit;
  }
  return result;
}

}  // namespace

namespace toi_internal {

void require_valid_options(const LeastDistanceOptions& options) {
  DYOP_REQUIRE(options.absolute_tolerance >= 0 && options.absolute_tolerance < kInfinity,
               "least_distance: absolute_tolerance must be finite and >= 0, not ",
               options.absolute_tolerance);
  DYOP_REQUIRE(options.relative_tolerance >= 0 && options.relative_tolerance < 1,
               "least_distance: relative_tolerance must be in [0, 1), not ",
               options.relative_tolerance);
  DYOP_REQUIRE(options.max_distance >= 0, "least_distance: max_distance must be >= 0, not ",
               options.max_distance);
  DYOP_REQUIRE(options.max_node_pairs > 0, "least_distance: max_node_pairs must be > 0, not ",
               options.max_node_pairs);
}

Scalar tolerance_of(const LeastDistanceOptions& options, const LeastDistanceResult& result) {
  const Scalar size = std::min(result.upper, options.max_distance);
  const Scalar asked = std::max(options.absolute_tolerance, options.relative_tolerance * size);
  return std::max(asked, 64 * result.rounding_allowance);
}

}  // namespace toi_internal

LeastDistanceResult least_distance(const Shape& a, const Motion& X_WA, const Shape& b,
                                   const Motion& X_WB, const TimeInterval& interval,
                                   const LeastDistanceOptions& options) {
  require_valid(interval, "least_distance: interval");
  require_defined(X_WA, interval, "least_distance: the motion of A");
  require_defined(X_WB, interval, "least_distance: the motion of B");
  toi_internal::require_valid_options(options);
  distance_internal::require_closed("least_distance", a, b, {options.solid_a, options.solid_b});
  return LeastDistanceSearch(a, X_WA, b, X_WB, interval, options).run();
}

}  // namespace dyop
