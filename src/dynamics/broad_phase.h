// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// Finds which of many boxes overlap without testing all pairs: sweep and prune along the axis with
/// the largest spread ([Cohen1995]), in slabs along the axis with the next largest. The order is
/// kept from step to step, so boxes that moved little are cheap to sort.
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
  struct Slabs {  // of equal width, the outermost ones without end
    Eigen::Index axis = 0;
    Scalar low = 0;
    Scalar per_length = 0;
    std::size_t count = 1;

    std::size_t at(Scalar x) const;  // never falls where x grows
  };

  Vector3 spread() const;
  void sort_along(Eigen::Index axis);
  Slabs make_slabs(Eigen::Index axis) const;

  struct Entry {
    AlignedBox box;
    std::int32_t number;
    bool may_move;
  };

  std::vector<AlignedBox> boxes_;
  std::vector<std::int32_t> order_;  // box numbers by their lower end along the axis
  std::vector<std::vector<Entry>>
      entries_;  // by slab, in the order of the sweep; kept for its memory
};

}  // namespace dyop::dynamics_internal
