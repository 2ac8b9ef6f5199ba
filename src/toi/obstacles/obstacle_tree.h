// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::toi_internal {

/// A binary tree of axis-aligned boxes over numbered items, halved at the middle of their centers.
class ObstacleTree {
 public:
  struct Item {
    AlignedBox box;
    std::uint32_t number = 0;
  };
  struct Node {
    AlignedBox box;
    /// The first of two neighbouring children, or -1 - the item's number.
    std::int64_t link = 0;

    bool is_leaf() const { return link < 0; }
    std::size_t child() const { return static_cast<std::size_t>(link); }
    std::uint32_t number() const { return static_cast<std::uint32_t>(-1 - link); }
  };

  ObstacleTree() = default;
  explicit ObstacleTree(std::vector<Item> items);

  /// Node 0 is the root; none if there are no items.
  const std::vector<Node>& nodes() const { return nodes_; }
  std::size_t item_count() const { return nodes_.empty() ? 0 : (nodes_.size() + 1) / 2; }

 private:
  std::vector<Node> nodes_;
};

}  // namespace dyop::toi_internal
