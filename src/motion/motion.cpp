// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/motion.h"

#include <algorithm>
#include <cmath>

#include "dyop/core/error.h"
#include "motion/curve/chart_curve.h"

namespace dyop {

PoseScale Motion::pose_scale(const TimeInterval& interval) const {
  const TwistBound bound = twist_bound(interval);
  const Scalar latest = std::max(std::abs(interval.begin), std::abs(interval.end));
  using motion_internal::times;
  return {pose(interval.begin).translation().stableNorm() +
              times(bound.linear_speed, interval.length() + latest),
          1 + times(bound.angular_speed, latest)};
}

void require_defined(const Motion& motion, const TimeInterval& interval, const char* what) {
  const TimeInterval domain = motion.domain();
  DYOP_REQUIRE(domain.begin <= interval.begin && interval.end <= domain.end, what,
               " is defined only on [", domain.begin, ", ", domain.end, "], not on all of [",
               interval.begin, ", ", interval.end, "]");
}

}  // namespace dyop
