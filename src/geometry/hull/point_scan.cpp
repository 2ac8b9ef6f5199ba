// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/hull/point_scan.h"

#include <algorithm>

namespace dyop::geometry_internal {

PointScan::PointScan(std::span<const Vector3> points) : blocks_((points.size() + 3) / kLanes) {
  for (std::size_t k = 0; k < blocks_.size() * kLanes; ++k) {
    const Vector3& p = points[std::min(k, points.size() - 1)];
    Block& block = blocks_[k / kLanes];
    const auto lane = static_cast<Eigen::Index>(k % kLanes);
    block.x[lane] = p.x();
    block.y[lane] = p.y();
    block.z[lane] = p.z();
  }
}

Scalar PointScan::largest(const Vector3& direction) const {
  Lanes best = blocks_.front().along(direction);
  for (std::size_t k = 1; k < blocks_.size(); ++k) best = best.max(blocks_[k].along(direction));
  return best.maxCoeff();
}

std::int32_t PointScan::farthest(const Vector3& direction) const {
  // Computed twice, with the same bits: cheaper than keeping track of numbers.
  const Scalar most = largest(direction);
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const Lanes value = blocks_[k].along(direction);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (value[static_cast<Eigen::Index>(lane)] == most) {
        return static_cast<std::int32_t>(k * kLanes + lane);
      }
    }
  }
  return 0;
}

Scalar PointScan::reach(const Vector3& direction) const {
  // A maximum may drop NaN; zero times the direction restores it.
  return largest(direction) + 0 * direction.sum();
}

}  // namespace dyop::geometry_internal
