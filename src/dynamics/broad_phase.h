// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::internal {

/// Finds which of many boxes overlap without testing all pairs: sweep and prune along the axis with
/// the largest spread ([Cohen1995]). The order is kept from step to step, so boxes that moved
/// little are cheap to sort.
class BroadPhase {
 public:
  /// Adds the next box; returns its number, 0, 1, 2, ... in order.
  std::int32_t add(const AlignedBox& box);

  /// Replaces a box. Infinite extents are legal.
  void update(std::int32_t number, const AlignedBox& box);

  /// All pairs (a, b), a < b, whose boxes overlap or touch, sorted; pairs in which neither may move
  /// are left out.
  std::vector<std::pair<std::int32_t, std::int32_t>> find_pairs(const std::vector<bool>& may_move);

 private:
  Eigen::Index sweep_axis() const;
  void sort_along(Eigen::Index axis);

  std::vector<AlignedBox> boxes_;
  std::vector<std::int32_t> order_;  // box numbers by their lower end along the axis
};

}  // namespace dyop::internal
