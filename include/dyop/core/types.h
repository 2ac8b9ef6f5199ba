// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Every number in dyop is a double; no option changes that.
using Scalar = double;

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;

/// Axis-aligned box, [min(), max()] per axis.
using AlignedBox = Eigen::AlignedBox3d;

inline constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();

}  // namespace dyop
