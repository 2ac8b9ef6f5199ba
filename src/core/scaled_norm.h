// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/core/types.h"

namespace dyop::core_internal {

/// Whether a squared norm neither overflowed nor underflowed.
template <typename Real>
bool is_safe_square(Real norm_sq) {
  // literal: properties of the number format; the squares of the components are normal numbers.
  return norm_sq > static_cast<Real>(1e-200) && norm_sq < static_cast<Real>(1e200);
}

/// |v| where squares overflow or underflow, too: what bounds rounding must not be lost to it. The
/// size is a sum because a sum keeps NaN, which a maximum may lose.
template <typename Real>
Real scaled_norm(const Eigen::Matrix<Real, 3, 1>& v) {
  const Real norm_sq = v.squaredNorm();
  if (is_safe_square(norm_sq)) return std::sqrt(norm_sq);
  const Real size = v.cwiseAbs().sum();
  return size > 0 ? size * (v / size).norm() : size;
}

}  // namespace dyop::core_internal
