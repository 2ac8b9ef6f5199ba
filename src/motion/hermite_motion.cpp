// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/hermite_motion.h"

#include "motion/curve/chart_curve.h"

namespace dyop {
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
