#include "dyop/motion/bezier_motion.h"

#include <algorithm>
#include <string>

#include "motion/bernstein_span.h"
#include "motion/rotation_rate.h"

namespace dyop {
namespace {

using internal::BernsteinSpan;

// Rounding of a curve's derivatives on a part grows no faster than this; 1 for cubics.
Scalar noise_of_degree(std::size_t degree) {
  const Scalar n = static_cast<Scalar>(degree);
  return kMotionNoise * std::max<Scalar>(1, n * (n - 1) / 6);
}

}  // namespace

BezierMotion::BezierMotion(const TimeInterval& interval, const Matrix3& R_WC,
                           std::span<const ControlPoint> control_points)
    : BezierMotion(interval, RigidPose(R_WC, Vector3::Zero()), control_points) {}

BezierMotion::BezierMotion(const TimeInterval& interval, const RigidPose& X_WC,
                           std::span<const ControlPoint> control_points)
    : interval_(interval),
      R_WC_(X_WC.rotation()),
      degree_(control_points.size() - 1) {
  require_valid(interval, "domain of Bezier motion");
  DYOP_REQUIRE(interval.length() > 0 && std::isfinite(interval.length()),
               "domain of Bezier motion must have a positive, finite length, not [", interval.begin,
               ", ", interval.end, "]");
  DYOP_REQUIRE(control_points.size() >= 2 && control_points.size() <= kMaxDegree + 1,
               "Bezier motion needs 2 to ", kMaxDegree + 1, " control points, not ",
               control_points.size());
  std::copy(control_points.begin(), control_points.end(), control_points_.begin());
  Coefficients displacement, theta;
  for (std::size_t i = 0; i <= degree_; ++i) {
    const std::string place = " of control point " + std::to_string(i);
    internal::require_finite(control_points[i].p_WB, ("position" + place).c_str());
    internal::require_finite(control_points[i].theta, ("rotation vector" + place).c_str());
    displacement[i] = control_points[i].p_WB - control_points[0].p_WB;
    theta[i] = control_points[i].theta;
  }
  displacement_ = make_curve(displacement);
  theta_ = make_curve(theta);
  for (const Curve* curve : {&displacement_, &theta_}) {
    DYOP_REQUIRE(std::isfinite(curve->acceleration_noise), "Bezier motion over a time of ",
                 interval_.length(), " is too fast: accelerations overflow");
  }
}

BezierMotion::Curve BezierMotion::make_curve(const Coefficients& value) const {
  const Scalar h = interval_.length();
  const Scalar noise = noise_of_degree(degree_);
  Curve curve;
  curve.value = value;
  internal::derive({value.data(), degree_ + 1}, h, curve.rate);
  internal::derive({curve.rate.data(), degree_}, h, curve.acceleration);
  curve.value_noise = noise * internal::largest_norm({value.data(), degree_ + 1});
  curve.rate_noise = noise * internal::largest_norm({curve.rate.data(), degree_});
  // Differences of the rates cancel: the error is relative to the rates, not to the differences.
  curve.acceleration_noise = curve.rate_noise / h;
  return curve;
}

MotionState BezierMotion::state(Scalar t) const {
  const Scalar s = parameter(t);
  const auto value = [&](const Curve& c) {
    return internal::evaluate({c.value.data(), degree_ + 1}, s);
  };
  const auto rate = [&](const Curve& c) { return internal::evaluate({c.rate.data(), degree_}, s); };
  const auto [R, w] = internal::turning_state(value(theta_), rate(theta_));
  return {RigidPose::from_trusted(R_WC_ * R, control_points_[0].p_WB + value(displacement_)),
          {rate(displacement_), R_WC_ * w}};
}

RigidPose BezierMotion::pose(Scalar t) const {
  return BezierMotion::state(t).X_WB;
}

Twist BezierMotion::twist(Scalar t) const {
  return BezierMotion::state(t).twist;
}

TwistBound BezierMotion::twist_bound(const TimeInterval& interval) const {
  using internal::round_up;
  const Scalar s0 = parameter(interval.begin);
  const Scalar s1 = parameter(interval.end);
  const std::size_t degree = degree_;
  const auto part = [=](const Coefficients& b, std::size_t count, Coefficients& buffer) {
    internal::restrict_to({b.data(), count}, s0, s1, buffer);
    return BernsteinSpan(buffer.data(), count);
  };
  const auto acceleration = [&](const Curve& curve) {
    Coefficients buffer;
    const BernsteinSpan over_part = part(curve.acceleration, degree - 1, buffer);
    return internal::largest_norm(over_part) + curve.acceleration_noise;
  };
  Coefficients v_buffer, theta_buffer, rate_buffer;
  const BernsteinSpan v = part(displacement_.rate, degree, v_buffer);
  const BernsteinSpan theta = part(theta_.value, degree + 1, theta_buffer);
  const BernsteinSpan theta_rate = part(theta_.rate, degree, rate_buffer);
  const Scalar turn_noise = theta_.value_noise * (theta_.rate_noise / noise_of_degree(degree));
  const Scalar turn = internal::largest_cross_product(theta, theta_rate) + turn_noise;
  const Scalar angular_speed = internal::largest_norm(theta_rate) + theta_.rate_noise;
  return {
      round_up(internal::largest_norm(v) + displacement_.rate_noise), round_up(angular_speed),
      round_up(acceleration(displacement_)),
      round_up(internal::angular_acceleration_bound(angular_speed, acceleration(theta_), turn))};
}

}  // namespace dyop
