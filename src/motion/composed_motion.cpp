// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/composed_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "motion/curve/chart_curve.h"
#include "motion/guarded_state.h"

namespace dyop {

ComposedMotion::ComposedMotion(std::shared_ptr<const Motion> X_WM,
                               std::shared_ptr<const Motion> X_MB)
    : outer_(std::move(X_WM)), inner_(std::move(X_MB)) {
  DYOP_REQUIRE(outer_ && inner_, "composed motion needs two motions, but one is null");
  const TimeInterval common = domain();
  DYOP_REQUIRE(common.begin <= common.end,
               "the two motions of a composed motion have no time in common: one starts at ",
               common.begin, ", the other ends at ", common.end);
}

TimeInterval ComposedMotion::domain() const {
  const TimeInterval outer = outer_->domain();
  const TimeInterval inner = inner_->domain();
  return {std::max(outer.begin, inner.begin), std::min(outer.end, inner.end)};
}

RigidPose ComposedMotion::pose(Scalar t) const {
  return outer_->pose(t) * inner_->pose(t);
}

Twist ComposedMotion::twist(Scalar t) const {
  const Matrix3 R_WM = outer_->pose(t).rotation();
  const Twist outer = outer_->twist(t);
  const Twist inner = inner_->twist(t);
  const Vector3 q_W = R_WM * inner_->pose(t).translation();
  return {outer.v_WB + outer.w_WB.cross(q_W) + R_WM * inner.v_WB, outer.w_WB + R_WM * inner.w_WB};
}

TwistBound ComposedMotion::twist_bound(const TimeInterval& interval) const {
  const TwistBound outer = outer_->twist_bound(interval);
  const TwistBound inner = inner_->twist_bound(interval);
  // Every time of the interval is within half its length of the middle. Infinite intervals give
  // infinity or NaN here, and round_up turns both into infinity.
  const Scalar middle = interval.begin + interval.length() / 2;
  const RigidPose X_MB = std::isfinite(middle) ? motion_internal::guarded_pose(
                                                     *inner_, middle, "composed motion: X_MB")
                                               : inner_->pose(middle);
  const Scalar p_norm = motion_internal::norm_of(X_MB.translation());
  const Scalar pose_noise = kPoseNoise * inner_->pose_scale(interval).length;
  const Scalar arm =
      motion_internal::round_up(p_norm + inner.linear_speed * (interval.length() / 2) + pose_noise);
  using motion_internal::round_up;
  return {round_up(outer.linear_speed + outer.angular_speed * arm + inner.linear_speed),
          round_up(outer.angular_speed + inner.angular_speed),
          round_up(outer.linear_acceleration +
                   (outer.angular_acceleration + outer.angular_speed * outer.angular_speed) * arm +
                   2 * outer.angular_speed * inner.linear_speed + inner.linear_acceleration),
          round_up(outer.angular_acceleration + outer.angular_speed * inner.angular_speed +
                   inner.angular_acceleration)};
}

PoseScale ComposedMotion::pose_scale(const TimeInterval& interval) const {
  const PoseScale outer = outer_->pose_scale(interval);
  const PoseScale inner = inner_->pose_scale(interval);
  return {outer.length + motion_internal::times(outer.angle + 1, inner.length),
          outer.angle + inner.angle};
}

Scalar ComposedMotion::smooth_until(Scalar t) const {
  return std::min(outer_->smooth_until(t), inner_->smooth_until(t));
}

}  // namespace dyop
