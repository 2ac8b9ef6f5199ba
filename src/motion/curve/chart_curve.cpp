// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/chart_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "motion/curve/bernstein.h"

namespace dyop::motion_internal {

template <std::size_t kMaxDegree>
ChartCurve<kMaxDegree>::ChartCurve(const char* motion, const TimeInterval& interval,
                                   const RigidPose& X_WC, const Vector3& p_W0, std::size_t degree,
                                   const Coefficients& displacement, const Coefficients& theta)
    : interval_(interval), R_WC_(X_WC.rotation()), p_W0_(p_W0), degree_(degree) {
  const Scalar h = interval.length();
  DYOP_REQUIRE(h > 0 && std::isfinite(h), "domain of ", motion,
               " must have a positive, finite length, not [", interval.begin, ", ", interval.end,
               "]");
  displacement_ = make_polynomial(displacement);
  theta_ = make_polynomial(theta);
  for (const Polynomial* polynomial : {&displacement_, &theta_}) {
    DYOP_REQUIRE(std::isfinite(polynomial->acceleration_noise), motion, " over a time of ", h,
                 " is too fast: accelerations overflow");
  }
}

// Rounding of a polynomial's derivatives on a part grows by at most this factor; 1 for cubics.
template <std::size_t kMaxDegree>
Scalar ChartCurve<kMaxDegree>::noise() const {
  const Scalar n = static_cast<Scalar>(degree_);
  return kMotionNoise * std::max<Scalar>(1, n * (n - 1) / 6);
}

template <std::size_t kMaxDegree>
auto ChartCurve<kMaxDegree>::make_polynomial(const Coefficients& value) const -> Polynomial {
  const Scalar h = interval_.length();
  Polynomial result;
  result.value = value;
  derive({value.data(), degree_ + 1}, h, result.rate);
  derive({result.rate.data(), degree_}, h, result.acceleration);
  result.value_noise = noise() * largest_norm({value.data(), degree_ + 1});
  result.rate_noise = noise() * largest_norm({result.rate.data(), degree_});
  // Differences of rates cancel: the error is relative to the rates, not to their differences.
  result.acceleration_noise = result.rate_noise / h;
  return result;
}

template <std::size_t kMaxDegree>
MotionState ChartCurve<kMaxDegree>::state(Scalar t) const {
  const Scalar s = parameter(t);
  const auto value = [&](const Polynomial& x) {
    return evaluate({x.value.data(), degree_ + 1}, s);
  };
  const auto rate = [&](const Polynomial& x) { return evaluate({x.rate.data(), degree_}, s); };
  const auto [R, w] = turning_state(value(theta_), rate(theta_));
  return {RigidPose::from_trusted(R_WC_ * R, p_W0_ + value(displacement_)),
          {rate(displacement_), R_WC_ * w}};
}

template <std::size_t kMaxDegree>
RigidPose ChartCurve<kMaxDegree>::pose(Scalar t) const {
  const Scalar s = parameter(t);
  const Vector3 theta = evaluate({theta_.value.data(), degree_ + 1}, s);
  return RigidPose::from_trusted(R_WC_ * turning_rotation(theta),
                                 p_W0_ + evaluate({displacement_.value.data(), degree_ + 1}, s));
}

template <std::size_t kMaxDegree>
Scalar ChartCurve<kMaxDegree>::acceleration_bound(const Polynomial& polynomial, Scalar s0,
                                                  Scalar s1) const {
  Coefficients part;
  restrict_to({polynomial.acceleration.data(), degree_ - 1}, s0, s1, part);
  return largest_norm({part.data(), degree_ - 1}) + polynomial.acceleration_noise;
}

template <std::size_t kMaxDegree>
TwistBound ChartCurve<kMaxDegree>::twist_bound(const TimeInterval& interval) const {
  const Scalar s0 = parameter(interval.begin);
  const Scalar s1 = parameter(interval.end);
  Coefficients v, theta, theta_rate;
  restrict_to({displacement_.rate.data(), degree_}, s0, s1, v);
  restrict_to({theta_.value.data(), degree_ + 1}, s0, s1, theta);
  restrict_to({theta_.rate.data(), degree_}, s0, s1, theta_rate);
  const Scalar speed = largest_norm({v.data(), degree_}) + displacement_.rate_noise;
  const Scalar angular_speed = largest_norm({theta_rate.data(), degree_}) + theta_.rate_noise;
  const Scalar turn_noise = theta_.value_noise * (theta_.rate_noise / noise());
  const Scalar turn =
      largest_cross_product({theta.data(), degree_ + 1}, {theta_rate.data(), degree_}) + turn_noise;
  return {round_up(speed), round_up(angular_speed),
          round_up(acceleration_bound(displacement_, s0, s1)),
          round_up(
              angular_acceleration_bound(angular_speed, acceleration_bound(theta_, s0, s1), turn))};
}

// De Casteljau's algorithm errs by about 7u of the largest coefficient per degree: less than the
// noise.
template <std::size_t kMaxDegree>
PoseScale ChartCurve<kMaxDegree>::pose_scale() const {
  return {p_W0_.stableNorm() + displacement_.value_noise / kPoseNoise,
          1 + theta_.value_noise / kPoseNoise};
}

template class ChartCurve<3>;
template class ChartCurve<9>;

namespace {

// (f - sin f) / f^3. Below one half the difference would lose digits; there the alternating
// series 1/3! - f^2/5! + ... is used, whose first omitted term f^14/17! is below u of the sum.
Scalar double_cross_coefficient(Scalar f, Scalar sine) {
  if (f > 0.5) return (f - sine) / (f * f * f);
  const Scalar x = f * f;
  Scalar sum = 1;
  for (const Scalar divisor : {210.0, 156.0, 110.0, 72.0, 42.0, 20.0}) sum = 1 - x / divisor * sum;
  return sum / 6;
}

struct HalfAngle {
  Scalar angle;  // the whole one
  Scalar sine, cosine;
  Scalar sinc;  // sine over half the angle
};

HalfAngle half_angle(const Vector3& theta) {
  const Scalar f = theta.norm();
  const Scalar sine = std::sin(f / 2);
  return {f, sine, std::cos(f / 2), f > 0 ? sine / (f / 2) : 1};
}

Matrix3 rotation(const Vector3& theta, const HalfAngle& half) {
  const Vector3 axis_part = theta * (half.sinc / 2);
  const Quaternion q(half.cosine, axis_part.x(), axis_part.y(), axis_part.z());
  return q.normalized().toRotationMatrix();
}

}  // namespace

Matrix3 turning_rotation(const Vector3& theta) {
  return rotation(theta, half_angle(theta));
}

TurningState turning_state(const Vector3& theta, const Vector3& theta_rate) {
  const HalfAngle half = half_angle(theta);
  // (1 - cos f) / f^2 through the half angle, which never cancels.
  const Scalar cross_coefficient = half.sinc * half.sinc / 2;
  const Vector3 turn = theta.cross(theta_rate);
  return {
      rotation(theta, half),
      theta_rate + cross_coefficient * turn +
          double_cross_coefficient(half.angle, 2 * half.sine * half.cosine) * theta.cross(turn)};
}

Vector3 angular_velocity(const Vector3& theta, const Vector3& theta_rate) {
  return turning_state(theta, theta_rate).w;
}

// theta' = w - theta x w / 2 + (1 - f/2 cot(f/2)) / f^2 theta x (theta x w), f = |theta|.
Vector3 rotation_vector_rate(const Vector3& theta, const Vector3& w_C) {
  constexpr Scalar kSmall = 1e-4;  // literal: the next term, f^4 / 720 of w, is below rounding
  const Scalar half = theta.norm() / 2;
  // Cancels, but by no more than rounding of the sum, where this is a small part.
  const Scalar coefficient =
      2 * half > kSmall ? (1 - half / std::tan(half)) / (4 * half * half) : Scalar{1} / 12;
  const Vector3 turn = theta.cross(w_C);
  return w_C - turn / 2 + coefficient * theta.cross(turn);
}

Scalar angular_acceleration_bound(Scalar theta_rate, Scalar theta_acceleration, Scalar theta_turn) {
  return theta_acceleration +
         theta_rate * std::min(theta_turn / 6, theta_rate * std::numbers::inv_pi);
}

}  // namespace dyop::motion_internal
