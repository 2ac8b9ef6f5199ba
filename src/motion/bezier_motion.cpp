// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/bezier_motion.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "motion/curve/chart_curve.h"

namespace dyop {
namespace {

using Curve = motion_internal::ChartCurve<BezierMotion::kMaxDegree>;

std::shared_ptr<const Curve> make_curve(const TimeInterval& interval, const RigidPose& X_WC,
                                        std::span<const ControlPoint> control_points) {
  require_valid(interval, "domain of Bezier motion");
  DYOP_REQUIRE(control_points.size() >= 2 && control_points.size() <= BezierMotion::kMaxDegree + 1,
               "Bezier motion needs 2 to ", BezierMotion::kMaxDegree + 1, " control points, not ",
               control_points.size());
  Curve::Coefficients displacement, theta;
  for (std::size_t i = 0; i < control_points.size(); ++i) {
    const ControlPoint& point = control_points[i];
    DYOP_REQUIRE(point.p_WB.allFinite(), "position of control point ", i, " must be finite, not (",
                 point.p_WB.transpose(), ")");
    DYOP_REQUIRE(point.theta.allFinite(), "rotation vector of control point ", i,
                 " must be finite, not (", point.theta.transpose(), ")");
    displacement[i] = point.p_WB - control_points[0].p_WB;
    theta[i] = point.theta;
  }
  return std::make_shared<const Curve>("Bezier motion", interval, X_WC, control_points[0].p_WB,
                                       control_points.size() - 1, displacement, theta);
}

}  // namespace

BezierMotion::BezierMotion(const TimeInterval& interval, const Matrix3& R_WC,
                           std::span<const ControlPoint> control_points)
    : BezierMotion(interval, RigidPose(R_WC, Vector3::Zero()), control_points) {}

BezierMotion::BezierMotion(const TimeInterval& interval, const RigidPose& X_WC,
                           std::span<const ControlPoint> control_points)
    : count_(control_points.size()), curve_(make_curve(interval, X_WC, control_points)) {
  std::copy(control_points.begin(), control_points.end(), control_points_.begin());
}

MotionState BezierMotion::state(Scalar t) const {
  return curve_->state(t);
}

RigidPose BezierMotion::pose(Scalar t) const {
  return curve_->pose(t);
}

Twist BezierMotion::twist(Scalar t) const {
  return curve_->state(t).twist;
}

TwistBound BezierMotion::twist_bound(const TimeInterval& interval) const {
  return curve_->twist_bound(interval);
}

RigidPose BezierMotion::X_WC() const {
  return curve_->X_WC();
}

TimeInterval BezierMotion::domain() const {
  return curve_->interval();
}

PoseScale BezierMotion::pose_scale(const TimeInterval&) const {
  return curve_->pose_scale();
}

}  // namespace dyop
