// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::motion_internal {

/// Speed bounds of the pieces of a motion, with the largest over any range of pieces in O(log n).
class SpeedTree {
 public:
  struct Speeds {
    Scalar linear = 0;   ///< length per time
    Scalar angular = 0;  ///< radians per time
  };

  SpeedTree() = default;
  explicit SpeedTree(const std::vector<Speeds>& pieces);

  /// Over the pieces first to last, inclusive; zero if there are none.
  Speeds largest(std::size_t first, std::size_t last) const;

 private:
  std::vector<Speeds> nodes_;  // node i holds the larger of nodes 2i and 2i + 1; the pieces last
};

}  // namespace dyop::motion_internal
