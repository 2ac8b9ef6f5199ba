// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/torque_free_turn.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::dynamics_internal {

TorqueFreeTurn::TorqueFreeTurn(const Matrix3& inverse_inertia_B, const Vector3& L_B)
    : inverse_inertia_B_(inverse_inertia_B) {
  // Time is scaled so that speeds are at most one: coefficients neither overflow nor vanish.
  const Scalar speed = inverse_inertia_B.norm() * L_B.norm();
  unit_ = speed > 0 ? 1 / speed : kInfinity;
  const bool turns = unit_ < kInfinity;
  if (!turns) unit_ = 1;
  std::array<Vector3, kDegree + 1> w_B;  // in units of 1 / unit_
  L_B_[0] = L_B;
  vector_[0].setZero();
  scalar_[0] = 1;
  w_B[0] = unit_ * (inverse_inertia_B * L_B);
  for (std::size_t k = 0; k < kDegree; ++k) {
    Vector3 L_rate = Vector3::Zero();
    Vector3 vector_rate = Vector3::Zero();
    Scalar scalar_rate = 0;
    for (std::size_t i = 0; i <= k; ++i) {
      const Vector3& w = w_B[k - i];
      L_rate += L_B_[i].cross(w);
      vector_rate += scalar_[i] * w + vector_[i].cross(w);
      scalar_rate -= vector_[i].dot(w);
    }
    const auto n = static_cast<Scalar>(k + 1);
    L_B_[k + 1] = L_rate / n;
    vector_[k + 1] = vector_rate / (2 * n);
    scalar_[k + 1] = scalar_rate / (2 * n);
    w_B[k + 1] = unit_ * (inverse_inertia_B * L_B_[k + 1]);
  }
  // Keeps the last two terms of each series below rounding, and the turn below a radian.
  Scalar reach = 1;
  for (const std::size_t k : {kDegree - 1, kDegree}) {
    const Scalar size = std::max(std::hypot(vector_[k].norm(), scalar_[k]), w_B[k].norm());
    const auto power = static_cast<Scalar>(k);
    if (size > 0) reach = std::min(reach, std::pow(kUnitRoundoff / size, 1 / power));
  }
  span_ = turns ? reach * unit_ : kInfinity;
}

TorqueFreeTurn::Turn TorqueFreeTurn::at(Scalar elapsed) const {
  const Scalar s = elapsed / unit_;
  Vector3 L_B = L_B_[kDegree];
  Vector3 vector = vector_[kDegree];
  Scalar scalar = scalar_[kDegree];
  for (std::size_t k = kDegree; k-- > 0;) {
    L_B = L_B * s + L_B_[k];
    vector = vector * s + vector_[k];
    scalar = scalar * s + scalar_[k];
  }
  const Scalar sine = vector.norm();
  Turn turn;
  turn.theta =
      sine > 0 ? Vector3(2 * std::atan2(sine, scalar) / sine * vector) : Vector3(2 * vector);
  const Vector3 w_B = inverse_inertia_B_ * L_B;
  // q w q^-1 with a quaternion of length one.
  const Vector3 half = 2 * vector.cross(w_B);
  turn.w_C = w_B + scalar * half + vector.cross(half);
  return turn;
}

}  // namespace dyop::dynamics_internal
