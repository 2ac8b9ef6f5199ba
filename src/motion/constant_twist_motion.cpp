// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/constant_twist_motion.h"

#include "motion/curve/chart_curve.h"
#include "motion/guarded_state.h"

namespace dyop {

ConstantTwistMotion::ConstantTwistMotion(const RigidPose& X_WB0, const Twist& twist_WB, Scalar t0)
    : X_WB0_(motion_internal::without_drift(X_WB0)), twist_WB_(twist_WB), t0_(t0) {
  DYOP_REQUIRE(std::isfinite(t0), "reference time must be finite, not ", t0);
  motion_internal::require_finite(twist_WB.v_WB, "velocity");
  motion_internal::require_finite(twist_WB.w_WB, "angular velocity");
  DYOP_REQUIRE(std::isfinite(twist_WB.w_WB.stableNorm()), "angular velocity (",
               twist_WB.w_WB.transpose(), ") is too large: its length overflows");
  R_WB_ = SteadyTurn(X_WB0_.rotation(), twist_WB.w_WB);
  bound_.linear_speed = motion_internal::round_up(motion_internal::norm_of(twist_WB.v_WB));
  bound_.angular_speed = motion_internal::round_up(motion_internal::norm_of(twist_WB.w_WB));
}

RigidPose ConstantTwistMotion::pose(Scalar t) const {
  const Scalar tau = t - t0_;
  return RigidPose::from_trusted(R_WB_.at(tau), X_WB0_.translation() + tau * twist_WB_.v_WB);
}

Twist ConstantTwistMotion::twist(Scalar) const {
  return twist_WB_;
}

MotionState ConstantTwistMotion::state(Scalar t) const {
  return {ConstantTwistMotion::pose(t), twist_WB_};
}

Twist ConstantTwistMotion::pose_change(Scalar t, const Twist& initial, const Twist& rate) const {
  const Scalar tau = t - t0_;
  const Vector3 theta = tau * twist_WB_.w_WB;
  return {initial.v_WB + tau * rate.v_WB,
          rotation_from_vector(theta) * initial.w_WB +
              motion_internal::angular_velocity(theta, tau * rate.w_WB)};
}

TwistBound ConstantTwistMotion::twist_bound(const TimeInterval&) const {
  return bound_;
}

PoseScale ConstantTwistMotion::pose_scale(const TimeInterval& interval) const {
  const Scalar tau = motion_internal::longest_time(t0_, interval);
  using motion_internal::times;
  return {X_WB0_.translation().stableNorm() + times(bound_.linear_speed, tau),
          1 + times(bound_.angular_speed, tau)};
}

}  // namespace dyop
