// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/bezier_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "dyop/core/error.h"
#include "motion/curve/bernstein.h"
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

namespace {

struct Spline {
  std::size_t degree;
  std::span<const Scalar> knots;
  std::span<const ControlPoint> points;

  std::size_t begin() const { return degree; }       // index of the knot where the domain starts
  std::size_t end() const { return points.size(); }  // and where it ends
};

void require_sound(const Spline& spline) {
  const std::size_t degree = spline.degree;
  DYOP_REQUIRE(degree >= 1 && degree <= BezierMotion::kMaxDegree,
               "degree of B-spline motion must be 1 to ", BezierMotion::kMaxDegree, ", not ",
               degree);
  DYOP_REQUIRE(spline.points.size() > degree, "B-spline motion of degree ", degree,
               " needs at least ", degree + 1, " control points, not ", spline.points.size());
  DYOP_REQUIRE(spline.knots.size() == spline.points.size() + degree + 1,
               "B-spline motion of degree ", degree, " with ", spline.points.size(),
               " control points needs ", spline.points.size() + degree + 1, " knots, not ",
               spline.knots.size());
  for (std::size_t i = 0; i < spline.knots.size(); ++i) {
    const Scalar t = spline.knots[i];
    DYOP_REQUIRE(std::isfinite(t), "knot ", i, " of B-spline motion must be finite, not ", t);
    DYOP_REQUIRE(i == 0 || t >= spline.knots[i - 1], "knots of B-spline motion must not decrease, ",
                 "but knot ", i, " = ", t, " follows knot ", i - 1, " = ", spline.knots[i - 1]);
    // degree + 1 equal knots inside the domain would break the curve.
    DYOP_REQUIRE(i <= degree || i >= spline.end() || t > spline.knots[i - degree], "knot ", i,
                 " = ", t, " of B-spline motion of degree ", degree, " occurs more than ", degree,
                 " times");
  }
  DYOP_REQUIRE(spline.knots[spline.begin()] < spline.knots[spline.end()],
               "domain of B-spline motion must have a positive length, not [",
               spline.knots[spline.begin()], ", ", spline.knots[spline.end()], "]");
}

// The polar form of the curve on the span from knot i to knot i + 1, with `from` (degree - count)
// times and `to` count times: de Boor's algorithm with a different argument at every level.
ControlPoint polar_form(const Spline& spline, std::size_t i, std::size_t count) {
  const std::size_t n = spline.degree;
  std::array<ControlPoint, BezierMotion::kMaxDegree + 1> x;
  for (std::size_t k = 0; k <= n; ++k) x[k] = spline.points[i - n + k];
  for (std::size_t level = 1; level <= n; ++level) {
    const Scalar u = spline.knots[level <= count ? i + 1 : i];
    for (std::size_t k = n; k >= level; --k) {
      const Scalar low = spline.knots[i - n + k];
      const Scalar high = spline.knots[i + 1 + k - level];
      const Scalar s = (u - low) / (high - low);  // in [0, 1]: low <= knot i < knot i + 1 <= high
      x[k].p_WB = motion_internal::mix(x[k - 1].p_WB, x[k].p_WB, s);
      x[k].theta = motion_internal::mix(x[k - 1].theta, x[k].theta, s);
    }
  }
  return x[n];
}

}  // namespace

SequenceMotion bspline_motion(std::size_t degree, std::span<const Scalar> knots,
                              const Matrix3& R_WC, std::span<const ControlPoint> control_points) {
  const Spline spline{degree, knots, control_points};
  require_sound(spline);
  for (const ControlPoint& point : control_points) {
    motion_internal::require_finite(point.p_WB, "position of a control point");
    motion_internal::require_finite(point.theta, "rotation vector of a control point");
  }
  std::vector<SequenceMotion::Part> parts;
  std::vector<ControlPoint> span(degree + 1);
  for (std::size_t i = spline.begin(); i < spline.end(); ++i) {
    const TimeInterval interval{knots[i], knots[i + 1]};
    if (interval.length() == 0) continue;
    const ControlPoint last = span.back();
    for (std::size_t k = 0; k <= degree; ++k) span[k] = polar_form(spline, i, k);
    if (!parts.empty())
      span.front() = last;  // equal up to rounding; leaves no gap between the parts
    parts.push_back({interval, std::make_shared<BezierMotion>(interval, R_WC, span)});
  }
  return SequenceMotion(std::move(parts));
}

}  // namespace dyop
