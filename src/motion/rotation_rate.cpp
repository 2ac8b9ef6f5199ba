#include "motion/rotation_rate.h"

#include <Eigen/LU>
#include <algorithm>
#include <numbers>

namespace dyop::internal {
namespace {

// (1 - cos f) / f^2 through the half angle: no cancellation anywhere.
Scalar cross_coefficient(Scalar f) {
  const Scalar sinc_half = f > 0 ? std::sin(f / 2) / (f / 2) : 1;
  return sinc_half * sinc_half / 2;
}

// (f - sin f) / f^3. Below one half the difference would lose digits; there the alternating
// series 1/3! - f^2/5! + ... is used, whose first omitted term f^14/17! is below u of the sum.
Scalar double_cross_coefficient(Scalar f) {
  if (f > 0.5) return (f - std::sin(f)) / (f * f * f);
  const Scalar x = f * f;
  Scalar sum = 1;
  for (const Scalar divisor : {210.0, 156.0, 110.0, 72.0, 42.0, 20.0}) sum = 1 - x / divisor * sum;
  return sum / 6;
}

}  // namespace

Vector3 angular_velocity(const Vector3& theta, const Vector3& theta_rate) {
  const Scalar f = theta.norm();
  const Vector3 turn = theta.cross(theta_rate);
  return theta_rate + cross_coefficient(f) * turn + double_cross_coefficient(f) * theta.cross(turn);
}

Vector3 rotation_vector_rate(const Vector3& theta, const Vector3& w_C) {
  Matrix3 jacobian;
  for (int k = 0; k < 3; ++k) jacobian.col(k) = angular_velocity(theta, Vector3::Unit(k));
  return jacobian.partialPivLu().solve(w_C);
}

Scalar angular_acceleration_bound(Scalar theta_rate, Scalar theta_acceleration, Scalar theta_turn) {
  return theta_acceleration +
         theta_rate * std::min(theta_turn / 6, theta_rate * std::numbers::inv_pi);
}

}  // namespace dyop::internal
