// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/steady_motions.h"

#include "motion/curve/chart_curve.h"
#include "motion/guarded_state.h"

namespace dyop {

RigidPose RestMotion::pose(Scalar) const {
  return X_WB_;
}

Twist RestMotion::twist(Scalar) const {
  return {};
}

TwistBound RestMotion::twist_bound(const TimeInterval&) const {
  return {};
}

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
  return {motion_internal::norm_of(X_WB0_.translation()) + times(bound_.linear_speed, tau),
          1 + times(bound_.angular_speed, tau)};
}

ScrewMotion::ScrewMotion(const RigidPose& X_WB0, const Screw& screw, Scalar t0)
    : X_WB0_(motion_internal::without_drift(X_WB0)), screw_(screw), t0_(t0) {
  DYOP_REQUIRE(std::isfinite(t0), "reference time must be finite, not ", t0);
  DYOP_REQUIRE(std::isfinite(screw_.turn_rate), "turn rate must be finite, not ", screw_.turn_rate);
  DYOP_REQUIRE(std::isfinite(screw_.slide_rate), "slide rate must be finite, not ",
               screw_.slide_rate);
  motion_internal::require_finite(screw.p_WA, "point of the screw axis");
  motion_internal::require_finite(screw.axis_W, "direction of the screw axis");
  const Scalar length = screw.axis_W.stableNorm();
  DYOP_REQUIRE(length > 0, "direction of the screw axis must not be zero");
  axis_W_ = (screw.axis_W / length).normalized();
  const Vector3 p_AB_W = X_WB0.translation() - screw.p_WA;
  p_WF0_ = screw.p_WA + axis_W_.dot(p_AB_W) * axis_W_;
  arm0_W_ = X_WB0.translation() - p_WF0_;
  const Scalar rho = motion_internal::norm_of(arm0_W_);
  bound_.linear_speed =
      motion_internal::round_up(std::hypot(screw_.slide_rate, screw_.turn_rate * rho));
  bound_.angular_speed = motion_internal::round_up(std::abs(screw_.turn_rate));
  bound_.linear_acceleration = motion_internal::round_up(screw_.turn_rate * screw_.turn_rate * rho);
}

Vector3 ScrewMotion::arm(Scalar tau) const {
  return rotation_from_vector(tau * screw_.turn_rate * axis_W_) * arm0_W_;
}

RigidPose ScrewMotion::pose(Scalar t) const {
  const Scalar tau = t - t0_;
  const Matrix3 turn = rotation_from_vector(tau * screw_.turn_rate * axis_W_);
  return RigidPose::from_trusted(turn * X_WB0_.rotation(),
                                 p_WF0_ + tau * screw_.slide_rate * axis_W_ + turn * arm0_W_);
}

Twist ScrewMotion::twist(Scalar t) const {
  const Vector3 w_WB = screw_.turn_rate * axis_W_;
  return {screw_.slide_rate * axis_W_ + w_WB.cross(arm(t - t0_)), w_WB};
}

TwistBound ScrewMotion::twist_bound(const TimeInterval&) const {
  return bound_;
}

PoseScale ScrewMotion::pose_scale(const TimeInterval& interval) const {
  const Scalar tau = motion_internal::longest_time(t0_, interval);
  using motion_internal::times;
  const Scalar angle = 1 + times(bound_.angular_speed, tau);
  return {p_WF0_.stableNorm() + times(std::abs(screw_.slide_rate), tau) +
              times(angle, arm0_W_.stableNorm()),
          angle};
}

}  // namespace dyop
