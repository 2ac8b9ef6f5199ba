// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/rotation_rate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dyop::motion_internal {
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
