// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/interpolated_motion.h"

#include "motion/curve/chart_curve.h"
#include "motion/guarded_state.h"

namespace dyop {

InterpolatedMotion::Chart InterpolatedMotion::make_chart(const RigidPose& X_WB0,
                                                         const RigidPose& X_WB1,
                                                         RotationPath path) {
  // A body that is driven by one such motion after another starts each where the last one ended.
  const Matrix3 R_WB0 = motion_internal::without_drift(X_WB0).rotation();
  const Matrix3& R_WB1 = X_WB1.rotation();
  if (path == RotationPath::RotationVector) {
    return {Matrix3::Identity(),
            {X_WB0.translation(), rotation_vector(R_WB0)},
            {X_WB1.translation(), rotation_vector(R_WB1)}};
  }
  return {R_WB0,
          {X_WB0.translation(), Vector3::Zero()},
          {X_WB1.translation(), rotation_vector(R_WB0.transpose() * R_WB1)}};
}

InterpolatedMotion::InterpolatedMotion(const TimeInterval& interval, const RigidPose& X_WB0,
                                       const RigidPose& X_WB1, RotationPath path)
    : InterpolatedMotion(interval, make_chart(X_WB0, X_WB1, path)) {}

InterpolatedMotion InterpolatedMotion::from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                                  const Node& begin, const Node& end) {
  return from_chart(interval, RigidPose(R_WC, Vector3::Zero()), begin, end);
}

InterpolatedMotion InterpolatedMotion::from_chart(const TimeInterval& interval,
                                                  const RigidPose& X_WC, const Node& begin,
                                                  const Node& end) {
  motion_internal::require_finite(begin.p_WB, "position at the start");
  motion_internal::require_finite(end.p_WB, "position at the end");
  motion_internal::require_finite(begin.theta, "rotation vector at the start");
  motion_internal::require_finite(end.theta, "rotation vector at the end");
  return InterpolatedMotion(interval, Chart{X_WC.rotation(), begin, end});
}

InterpolatedMotion::InterpolatedMotion(const TimeInterval& interval, const Chart& chart)
    : interval_(interval), R_WC_(chart.R_WC), begin_(chart.begin), end_(chart.end) {
  require_valid(interval, "domain of interpolated motion");
  const Scalar h = interval.length();
  v_WB_ = (chart.end.p_WB - chart.begin.p_WB) / h;
  theta_rate_ = (chart.end.theta - chart.begin.theta) / h;
  DYOP_REQUIRE(h > 0 && v_WB_.allFinite() && theta_rate_.allFinite(),
               "domain of interpolated motion must have a positive length and finite velocities, "
               "not [",
               interval.begin, ", ", interval.end, "]");
  const Scalar theta_rate = motion_internal::norm_of(theta_rate_);
  // theta x theta' is constant along the path; its rounding is relative to the factors.
  const Scalar turn = begin_.theta.cross(theta_rate_).norm();
  const Scalar turn_noise = kMotionNoise * begin_.theta.norm() * theta_rate;
  bound_.linear_speed = motion_internal::round_up(motion_internal::norm_of(v_WB_));
  bound_.angular_speed = motion_internal::round_up(theta_rate);
  bound_.angular_acceleration = motion_internal::round_up(
      motion_internal::angular_acceleration_bound(theta_rate, 0, turn + turn_noise));
  // Velocities are sums of products: they may overflow where their squares do.
  DYOP_REQUIRE(bound_.linear_speed < kInfinity && bound_.angular_speed < kInfinity,
               "interpolated motion over a time of ", h, " is too fast: velocities overflow");
}

MotionState InterpolatedMotion::state(Scalar t) const {
  const Scalar tau = t - interval_.begin;
  const auto [R, w] = motion_internal::turning_state(begin_.theta + tau * theta_rate_, theta_rate_);
  return {RigidPose::from_trusted(R_WC_ * R, begin_.p_WB + tau * v_WB_), {v_WB_, R_WC_ * w}};
}

RigidPose InterpolatedMotion::pose(Scalar t) const {
  return InterpolatedMotion::state(t).X_WB;
}

Twist InterpolatedMotion::twist(Scalar t) const {
  return InterpolatedMotion::state(t).twist;
}

TwistBound InterpolatedMotion::twist_bound(const TimeInterval&) const {
  return bound_;
}

PoseScale InterpolatedMotion::pose_scale(const TimeInterval&) const {
  return {begin_.p_WB.stableNorm() + end_.p_WB.stableNorm(),
          1 + begin_.theta.stableNorm() + end_.theta.stableNorm()};
}

namespace {

using motion_internal::require_finite;
using Cubic = motion_internal::ChartCurve<3>::Coefficients;

// Cubic through x0 and x1 with derivatives v0 and v1 with respect to t = h s.
Cubic cubic_hermite(const Vector3& x0, const Vector3& v0, const Vector3& x1, const Vector3& v1,
                    Scalar h) {
  return {x0, x0 + h / 3 * v0, x1 - h / 3 * v1, x1};
}

std::shared_ptr<const motion_internal::ChartCurve<3>> make_curve(const TimeInterval& interval,
                                                                 const RigidPose& X_WC,
                                                                 const HermiteNode& begin,
                                                                 const HermiteNode& end) {
  require_valid(interval, "domain of Hermite motion");
  require_finite(begin.p_WB, "position at the start");
  require_finite(begin.v_WB, "velocity at the start");
  require_finite(begin.theta, "rotation vector at the start");
  require_finite(begin.theta_rate, "rotation vector's rate at the start");
  require_finite(end.p_WB, "position at the end");
  require_finite(end.v_WB, "velocity at the end");
  require_finite(end.theta, "rotation vector at the end");
  require_finite(end.theta_rate, "rotation vector's rate at the end");
  const Scalar h = interval.length();
  return std::make_shared<const motion_internal::ChartCurve<3>>(
      "Hermite motion", interval, X_WC, begin.p_WB, 3,
      cubic_hermite(Vector3::Zero(), begin.v_WB, end.p_WB - begin.p_WB, end.v_WB, h),
      cubic_hermite(begin.theta, begin.theta_rate, end.theta, end.theta_rate, h));
}

HermiteNode begin_node(const MotionState& begin) {
  require_finite(begin.twist.w_WB, "angular velocity at the start");
  return {begin.X_WB.translation(), begin.twist.v_WB, Vector3::Zero(),
          begin.X_WB.rotation().transpose() * begin.twist.w_WB};
}

HermiteNode end_node(const MotionState& begin, const MotionState& end) {
  require_finite(end.twist.w_WB, "angular velocity at the end");
  const Matrix3 R_CW = begin.X_WB.rotation().transpose();
  const Vector3 theta = rotation_vector(R_CW * end.X_WB.rotation());
  return {end.X_WB.translation(), end.twist.v_WB, theta,
          motion_internal::rotation_vector_rate(theta, R_CW * end.twist.w_WB)};
}

}  // namespace

HermiteMotion::HermiteMotion(const TimeInterval& interval, const RigidPose& X_WC,
                             const HermiteNode& begin, const HermiteNode& end)
    : begin_(begin), end_(end), curve_(make_curve(interval, X_WC, begin, end)) {}

HermiteMotion::HermiteMotion(const TimeInterval& interval, const MotionState& begin,
                             const MotionState& end)
    : HermiteMotion(interval, begin.X_WB, begin_node(begin), end_node(begin, end)) {}

HermiteMotion HermiteMotion::from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                        const HermiteNode& begin, const HermiteNode& end) {
  return from_chart(interval, RigidPose(R_WC, Vector3::Zero()), begin, end);
}

HermiteMotion HermiteMotion::from_chart(const TimeInterval& interval, const RigidPose& X_WC,
                                        const HermiteNode& begin, const HermiteNode& end) {
  return HermiteMotion(interval, X_WC, begin, end);
}

MotionState HermiteMotion::state(Scalar t) const {
  return curve_->state(t);
}

RigidPose HermiteMotion::pose(Scalar t) const {
  return curve_->pose(t);
}

Twist HermiteMotion::twist(Scalar t) const {
  return curve_->state(t).twist;
}

TwistBound HermiteMotion::twist_bound(const TimeInterval& interval) const {
  return curve_->twist_bound(interval);
}

RigidPose HermiteMotion::X_WC() const {
  return curve_->X_WC();
}

TimeInterval HermiteMotion::domain() const {
  return curve_->interval();
}

PoseScale HermiteMotion::pose_scale(const TimeInterval&) const {
  return curve_->pose_scale();
}

}  // namespace dyop
