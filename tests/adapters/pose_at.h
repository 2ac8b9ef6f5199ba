// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <limits>

namespace dyop::testing {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A pose without rotation, as most hosts take it.
inline Eigen::Isometry3d at(double x, double y, double z) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(x, y, z);
  return X;
}

}  // namespace dyop::testing
