// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "dyop/toi/toi_workspace.h"
#include "toi/obstacles/gap_search.h"

namespace dyop::toi_internal {

/// The body and an obstacle, and the state of their search.
struct ObstaclePair {
  std::uint32_t slot = 0;
  TimeInterval interval;
  std::int64_t portion = 0;  ///< node pairs of the next portion
  bool is_begun = false;
  ToiResult result;
  ToiWorkspace workspace;
};

/// The contents of an ObstacleWorkspace.
struct ObstacleMemory {
  ObstacleQueue queue;
  std::vector<std::unique_ptr<ObstaclePair>> pairs;  ///< the first `used` ones belong to this query
  std::size_t used = 0;
};

}  // namespace dyop::toi_internal
