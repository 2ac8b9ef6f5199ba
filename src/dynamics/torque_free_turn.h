// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// How a rigid body turns without torque: the Taylor series of its angular momentum in body axes
/// and of its quaternion about a start time. The equations are quadratic, so the coefficients
/// follow from each other by sums of products ([Jorba2005]).
class TorqueFreeTurn {
 public:
  /// From the angular momentum at the start, in the axes that B has then.
  TorqueFreeTurn(const Matrix3& inverse_inertia_B, const Vector3& L_B);

  /// Up to this time after the start the series are exact to rounding; > 0, may be infinite.
  Scalar span() const { return span_; }

  struct Turn {
    Vector3 theta;  // rotation vector from the start to now; its length is at most pi
    Vector3 w_C;    // angular velocity in the axes of B at the start
  };
  /// `elapsed` in [0, span()].
  Turn at(Scalar elapsed) const;

 private:
  static constexpr std::size_t kDegree = 16;
  // Coefficients in powers of elapsed / unit_.
  std::array<Vector3, kDegree + 1> L_B_;
  std::array<Vector3, kDegree + 1> vector_;  // of the quaternion
  std::array<Scalar, kDegree + 1> scalar_{};
  Matrix3 inverse_inertia_B_;
  Scalar unit_ = 1;
  Scalar span_ = 0;
};

}  // namespace dyop::dynamics_internal
