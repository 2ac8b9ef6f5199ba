// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/obstacle_tree.h"

#include <algorithm>
#include <span>
#include <utility>

namespace dyop::toi_internal {

ObstacleTree::ObstacleTree(std::vector<Item> items) {
  if (items.empty()) return;
  nodes_.reserve(2 * items.size() - 1);
  nodes_.emplace_back();
  std::vector<std::pair<std::size_t, std::span<Item>>> open{{0, items}};
  while (!open.empty()) {
    const auto [number, part] = open.back();
    open.pop_back();
    AlignedBox box;
    AlignedBox centers;
    for (const Item& item : part) {
      box.extend(item.box);
      centers.extend(item.box.center());
    }
    nodes_[number].box = box;
    if (part.size() == 1) {
      nodes_[number].link = -1 - std::int64_t(part[0].number);
      continue;
    }
    Eigen::Index axis = 0;
    centers.sizes().maxCoeff(&axis);
    const std::size_t middle = part.size() / 2;
    std::nth_element(part.begin(), part.begin() + std::ptrdiff_t(middle), part.end(),
                     [&](const Item& x, const Item& y) {
                       return std::make_pair(x.box.center()[axis], x.number) <
                              std::make_pair(y.box.center()[axis], y.number);
                     });
    const std::size_t child = nodes_.size();
    nodes_[number].link = std::int64_t(child);
    nodes_.resize(child + 2);
    open.emplace_back(child, part.first(middle));
    open.emplace_back(child + 1, part.subspan(middle));
  }
}

}  // namespace dyop::toi_internal
