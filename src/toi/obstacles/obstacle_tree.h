// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::toi_internal {

/// A binary tree of axis-aligned boxes over numbered items that come and go one at a time.
///
/// A new leaf goes where the boxes around it grow least; on the way back up a grandchild changes
/// places with its uncle where that makes a box smaller, so that the tree stays shallow whatever
/// the order of the items. Once it holds twice as many items as when it was last built, it is built
/// anew, halved at the middle of the centers.
class ObstacleTree {
 public:
  static constexpr std::int32_t kNone = -1;

  struct Node {
    AlignedBox box;
    std::int32_t parent = kNone;
    std::array<std::int32_t, 2> children{kNone, kNone};  ///< none: a leaf
    std::uint32_t number = 0;                            ///< of a leaf's item

    bool is_leaf() const { return children[0] == kNone; }
  };

  /// Returns the node of the item's leaf, which keeps it until the item is removed.
  std::int32_t insert(const AlignedBox& box, std::uint32_t number);
  /// Removes an item's leaf. Costs O(depth).
  void remove(std::int32_t leaf);

  std::int32_t root() const { return root_; }  ///< kNone if there are no items
  const Node& node(std::int32_t number) const { return nodes_[static_cast<std::size_t>(number)]; }
  std::size_t item_count() const { return item_count_; }

 private:
  Node& at(std::int32_t number) { return nodes_[static_cast<std::size_t>(number)]; }
  std::int32_t new_node();
  std::int32_t best_sibling(const AlignedBox& box) const;
  void replace_child(std::int32_t parent, std::int32_t from, std::int32_t to);
  void join(std::int32_t leaf, std::int32_t sibling);
  void mend_up(std::int32_t number);
  void fit(std::int32_t number);
  void rotate(std::int32_t number);
  void rebuild();

  std::vector<Node> nodes_;
  std::vector<std::int32_t> free_;
  std::int32_t root_ = kNone;
  std::size_t item_count_ = 0;
  std::size_t built_count_ = 0;
};

}  // namespace dyop::toi_internal
