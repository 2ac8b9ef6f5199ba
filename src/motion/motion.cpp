// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/core/error.h"
#include "motion/curve/chart_curve.h"

namespace dyop {

PoseScale Motion::pose_scale(const TimeInterval& interval) const {
  const TwistBound bound = twist_bound(interval);
  const Scalar latest = std::max(std::abs(interval.begin), std::abs(interval.end));
  using motion_internal::times;
  return {motion_internal::norm_of(pose(interval.begin).translation()) +
              times(bound.linear_speed, interval.length() + latest),
          1 + times(bound.angular_speed, latest)};
}

std::optional<MotionStretch> Motion::stretch(Scalar, Scalar) const {
  return std::nullopt;
}

void require_defined(const Motion& motion, const TimeInterval& interval, const char* what) {
  const TimeInterval domain = motion.domain();
  DYOP_REQUIRE(domain.begin <= interval.begin && interval.end <= domain.end, what,
               " is defined only on [", domain.begin, ", ", domain.end, "], not on all of [",
               interval.begin, ", ", interval.end, "]");
}

void require_valid(const TwistBound& bound, const TimeInterval& interval, const char* what) {
  DYOP_REQUIRE(bound.linear_speed >= 0 && bound.angular_speed >= 0 &&
                   bound.linear_acceleration >= 0 && bound.angular_acceleration >= 0,
               what, " on [", interval.begin, ", ", interval.end,
               "] must not be negative or NaN: linear speed ", bound.linear_speed,
               ", angular speed ", bound.angular_speed, ", linear acceleration ",
               bound.linear_acceleration, ", angular acceleration ", bound.angular_acceleration);
}

UserMotion::UserMotion(Functions functions, const TimeInterval& domain)
    : functions_(std::move(functions)), domain_(domain) {
  DYOP_REQUIRE(functions_.pose, "user motion needs a pose function");
  DYOP_REQUIRE(functions_.twist, "user motion needs a twist function");
  DYOP_REQUIRE(functions_.twist_bound, "user motion needs a twist_bound function");
  DYOP_REQUIRE(domain.begin <= domain.end, "domain of user motion must not be reversed: begin ",
               domain.begin, ", end ", domain.end);
}

RigidPose UserMotion::pose(Scalar t) const {
  return functions_.pose(t);
}

Twist UserMotion::twist(Scalar t) const {
  return functions_.twist(t);
}

TwistBound UserMotion::twist_bound(const TimeInterval& interval) const {
  const TwistBound bound = functions_.twist_bound(interval);
  require_valid(bound, interval, "twist_bound of a user motion");
  return bound;
}

Scalar UserMotion::smooth_until(Scalar t) const {
  if (!functions_.smooth_until) return Motion::smooth_until(t);
  const Scalar until = functions_.smooth_until(t);
  DYOP_REQUIRE(until > t, "smooth_until of a user motion must be after ", t, ", not ", until);
  return until;
}

}  // namespace dyop
