// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/gap_history.h"

#include <algorithm>

#include "dyop/distance/distance.h"

namespace dyop::cli {
namespace {

// Bounds the speed of all points of a body over an interval.
Scalar speed_bound(const Shape& shape, const Motion& motion, const TimeInterval& interval) {
  const TwistBound bound = motion.twist_bound(interval);
  return bound.linear_speed + bound.angular_speed * shape.bounding_radius();
}

class GapMeter {
 public:
  explicit GapMeter(const ToiQuery& query) : query_(query) {
    options_.solid_a = query.options.solid_a;
    options_.solid_b = query.options.solid_b;
  }

  GapSample at(Scalar t) {
    const DistanceResult result = distance(*query_.a, query_.X_WA->pose(t), *query_.b,
                                           query_.X_WB->pose(t), options_, cache_);
    return {t, result.lower, result.upper};
  }

 private:
  const ToiQuery& query_;
  DistanceOptions options_;
  DistanceCache cache_;
};

}  // namespace

GapHistory gap_history(const ToiQuery& query, Scalar tolerance, int sample_count, int most_steps) {
  GapHistory history;
  GapMeter meter(query);
  const TimeInterval& interval = query.interval;
  for (int k = 0; k < sample_count; ++k) {
    const Scalar t = k + 1 == sample_count
                         ? interval.end
                         : interval.begin + interval.length() * k / (sample_count - 1);
    history.samples.push_back(meter.at(t));
  }
  Scalar t = interval.begin;
  while (t < interval.end) {
    if (int(history.steps.size()) == most_steps) {
      history.is_cut = true;
      break;
    }
    const Scalar lower = meter.at(t).lower;
    const Scalar slack = lower - query.options.target_distance;
    if (!(slack > tolerance)) break;
    const TimeInterval rest{t, interval.end};
    const Scalar speed =
        speed_bound(*query.a, *query.X_WA, rest) + speed_bound(*query.b, *query.X_WB, rest);
    // A body that rests never comes nearer.
    const Scalar length = speed > 0 ? std::min(slack / speed, rest.length()) : rest.length();
    if (!(t + length > t)) break;
    history.steps.push_back({t, length, lower, speed});
    t += length;
  }
  return history;
}

}  // namespace dyop::cli
