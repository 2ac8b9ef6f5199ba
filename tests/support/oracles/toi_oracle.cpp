// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/toi_oracle.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <vector>

#include "dyop/core/error.h"

namespace dyop::testing {
namespace {

constexpr int kMaxSamples = 1'000'000;
// Parts that min_distance_on() samples before it bisects.
constexpr int kFirstParts = 16;
// The precision of a distance far above the target.
constexpr Scalar kFarPrecision = 0.05;
// The same while the target is unknown and only a distance that is attained is known.
constexpr Scalar kExcessPrecision = 0.25;
// Products and sums of the Lipschitz bound, rounded up.
constexpr Scalar kRoundUp = 1 + 0x1p-45;

struct Sample {
  Scalar t;
  Scalar lower;
};

struct Part {
  Sample begin;
  Sample end;
  Scalar lower;

  bool operator<(const Part& other) const { return lower > other.lower; }  // smallest on top
};

void count_sample(int& samples) {
  if (++samples > kMaxSamples) throw InternalError("the oracle needs more than a million samples");
}

void require_resolution(Scalar resolution) {
  DYOP_REQUIRE(resolution > 0, "resolution must be > 0, not ", resolution);
}

}  // namespace

ToiOracle::ToiOracle(const OracleBody& a, const Motion& X_WA, const OracleBody& b,
                     const Motion& X_WB)
    : a_(a), b_(b), X_WA_(X_WA), X_WB_(X_WB) {}

Scalar ToiOracle::approach_speed_bound(const TimeInterval& interval) const {
  const TwistBound a = X_WA_.twist_bound(interval);
  const TwistBound b = X_WB_.twist_bound(interval);
  const Scalar bound = (a.linear_speed + b.linear_speed + a.angular_speed * a_.radius() +
                        b.angular_speed * b_.radius()) *
                       kRoundUp;
  DYOP_REQUIRE(std::isfinite(bound), "the oracle needs a finite speed bound, not ", bound);
  return bound;
}

DistanceBracket ToiOracle::surface_distance(Scalar t, const SearchGap& gap) {
  return fast_oracle_distance(a_, X_WA_.pose(t), b_, X_WB_.pose(t), gap, seed_);
}

bool ToiOracle::contains_at(Scalar t) const {
  return oracle_contains(a_.shape(), X_WA_.pose(t), b_.shape(), X_WB_.pose(t));
}

DistanceBracket ToiOracle::distance_at(Scalar t, Scalar resolution) {
  if (contains_at(t)) return {0, 0};
  return surface_distance(t, {resolution});
}

MinimumDistance ToiOracle::min_distance_on(const TimeInterval& interval, Scalar resolution) {
  require_valid(interval);
  require_resolution(resolution);
  MinimumDistance result{0, kInfinity, interval.begin, 0};
  // A body cannot get inside another one later without their surfaces meeting.
  if (contains_at(interval.begin)) return {0, 0, interval.begin, 1};

  const auto sample = [&](Scalar t) {
    count_sample(result.samples);
    // Precise where it may be the minimum. Elsewhere the error is a fraction of the excess over a
    // distance that is attained, so that the lower bound stays above the minimum.
    const Scalar met = result.upper;
    const SearchGap gap = std::isfinite(met) ? SearchGap{resolution / 4, kExcessPrecision, met}
                                             : SearchGap{resolution / 4};
    const DistanceBracket d = surface_distance(t, gap);
    if (d.upper < result.upper) {
      result.upper = d.upper;
      result.t = t;
    }
    return Sample{t, d.lower};
  };
  std::priority_queue<Part> parts;
  const auto push = [&](const Sample& begin, const Sample& end) {
    // The cone below the first sample meets the cone below the second.
    const Scalar reach = approach_speed_bound({begin.t, end.t}) * (end.t - begin.t) * kRoundUp;
    parts.push({begin, end, std::max(0.0, (begin.lower + end.lower - reach) / 2)});
  };

  Sample last = sample(interval.begin);
  for (int k = 1; k <= kFirstParts; ++k) {
    const Scalar t = k == kFirstParts
                         ? interval.end
                         : interval.begin + interval.length() * (Scalar(k) / kFirstParts);
    const Sample next = sample(t);
    push(last, next);
    last = next;
  }
  // Ends: a part shorter than resolution / L leaves less than the resolution open, or its times
  // are neighbours, or count_sample() throws.
  while (true) {
    const Part part = parts.top();
    parts.pop();
    const Scalar middle = part.begin.t + (part.end.t - part.begin.t) / 2;
    const bool is_point = middle <= part.begin.t || middle >= part.end.t;
    result.lower = std::min(part.lower, result.upper);
    if (result.lower >= result.upper - resolution || is_point) return result;
    const Sample between = sample(middle);
    push(part.begin, between);
    push(between, part.end);
  }
}

// The speed bound over all the rest is a start; over the span that the step reaches it is often
// smaller.
Scalar ToiOracle::safe_step(Scalar t, Scalar end, Scalar slack) const {
  const auto reach = [&](Scalar until) {
    const Scalar speed = approach_speed_bound({t, until});
    return speed > 0 ? std::min(until - t, slack / speed / kRoundUp) : until - t;
  };
  const Scalar step = reach(end);
  const Scalar wider = std::min(end, t + 4 * step);
  return wider > t ? std::max(step, reach(wider)) : step;
}

FirstApproach ToiOracle::first_time_within(Scalar distance, const TimeInterval& interval,
                                           Scalar resolution) {
  require_valid(interval);
  require_resolution(resolution);
  FirstApproach result;
  if (contains_at(interval.begin)) return {interval.begin, {0, 0}, 1};
  Scalar t = interval.begin;
  while (true) {
    count_sample(result.samples);
    result.at_t = surface_distance(t, {resolution / 4, kFarPrecision, distance});
    if (result.at_t.lower <= distance + resolution / 2) {
      result.t = t;
      return result;
    }
    if (t >= interval.end) return result;
    const Scalar next = t + safe_step(t, interval.end, result.at_t.lower - distance);
    // Times are discrete: where the step is below their spacing, the resolution cannot be met.
    if (!(next > t)) throw InternalError("the oracle's resolution is below that of time");
    t = next;
  }
}

}  // namespace dyop::testing
