// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A rotation at constant angular velocity, R(tau) = exp(tau [w]) R0, by Rodrigues' formula with
/// everything precomputed but one sine and one cosine: R(tau) = S + cos(|w| tau) P + sin(|w| tau)
/// Q. Orthonormal and exact to a few roundings of the angle |w| tau.
class SteadyTurn {
 public:
  SteadyTurn() = default;

  /// @param R0 Rotation at tau = 0.
  /// @param w  Angular velocity, radians per time, in the frame that R0 maps into, of any finite
  ///           length.
  SteadyTurn(const Matrix3& R0, const Vector3& w) : rate_(w.stableNorm()), fixed_(R0) {
    if (!(rate_ > 0)) return;
    const Vector3 axis = (w / rate_).normalized();
    fixed_ = axis * (axis.transpose() * R0);
    cosine_part_ = R0 - fixed_;
    for (int k = 0; k < 3; ++k) sine_part_.col(k) = axis.cross(R0.col(k));
  }

  Matrix3 at(Scalar tau) const {
    if (rate_ == 0) return fixed_;
    const Scalar angle = rate_ * tau;
    return fixed_ + std::cos(angle) * cosine_part_ + std::sin(angle) * sine_part_;
  }

 private:
  Scalar rate_ = 0;
  Matrix3 fixed_ = Matrix3::Identity();
  Matrix3 cosine_part_ = Matrix3::Zero();
  Matrix3 sine_part_ = Matrix3::Zero();
};

}  // namespace dyop
