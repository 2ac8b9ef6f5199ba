// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/hull/point_scan.h"

#include <algorithm>
#include <array>

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
  if (blocks_.size() > kKeptBlocks) return farthest_of_many(direction);
  // The values are kept: looking for the largest among them is cheaper than keeping track of
  // numbers.
  std::array<Lanes, kKeptBlocks> values;
  Lanes best = values[0] = blocks_.front().along(direction);
  for (std::size_t k = 1; k < blocks_.size(); ++k) {
    values[k] = blocks_[k].along(direction);
    best = best.max(values[k]);
  }
  const Scalar most = best.maxCoeff();
  const Scalar* value = values[0].data();
  for (std::size_t k = 0; k < blocks_.size() * kLanes; ++k) {
    if (value[k] == most) return static_cast<std::int32_t>(k);
  }
  return 0;
}

std::int32_t PointScan::farthest_of_many(const Vector3& direction) const {
  // Computed twice, with the same bits.
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
