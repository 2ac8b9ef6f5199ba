// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <type_traits>

#include "dyop/motion/motion.h"

namespace dyop::motion_internal {

/// f'(t) of a vector or matrix function by the central difference of sixth order: the error is
/// step^6/140 f^(7) plus about 2u |f| / step.
auto differentiate(const auto& f, Scalar t, Scalar step) {
  using Value = std::decay_t<decltype(f(t))>;
  const Value far = f(t + 3 * step) - f(t - 3 * step);
  const Value middle = f(t + 2 * step) - f(t - 2 * step);
  const Value near = f(t + step) - f(t - step);
  return Value((45 * near - 9 * middle + far) / (60 * step));
}

/// The twist by differences of the pose alone; w from the skew part of R' R^T.
inline Twist twist_by_differences(const Motion& motion, Scalar t, Scalar step) {
  const Matrix3 rate =
      differentiate([&](Scalar x) { return Matrix3(motion.pose(x).rotation()); }, t, step);
  const Matrix3 spin = rate * motion.pose(t).rotation().transpose();
  return {differentiate([&](Scalar x) { return Vector3(motion.pose(x).translation()); }, t, step),
          Vector3(spin(2, 1) - spin(1, 2), spin(0, 2) - spin(2, 0), spin(1, 0) - spin(0, 1)) / 2};
}

}  // namespace dyop::motion_internal
