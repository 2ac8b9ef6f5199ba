// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::geometry_internal {

// Finds farthest points of a fixed list by testing all of them, four at a time.
class PointScan {
 public:
  explicit PointScan(std::span<const Vector3> points);  // at least one

  // The first of the points with the largest computed direction . p; 0 if that is NaN.
  std::int32_t farthest(const Vector3& direction) const;

  // The largest computed direction . p; NaN if the direction is not finite.
  Scalar reach(const Vector3& direction) const;

 private:
  static constexpr std::size_t kLanes = 4;
  using Lanes = Eigen::Array<Scalar, kLanes, 1>;

  struct Block {
    Lanes x;
    Lanes y;
    Lanes z;

    Lanes along(const Vector3& d) const { return x * d.x() + y * d.y() + z * d.z(); }
  };

  static constexpr std::size_t kKeptBlocks = 32;

  Scalar largest(const Vector3& direction) const;
  std::int32_t farthest_of_many(const Vector3& direction) const;

  std::vector<Block> blocks_;  // the last one is filled up with the last point
};

}  // namespace dyop::geometry_internal
