// SPDX-License-Identifier: BSD-3-Clause
#include "motion/curve/speed_tree.h"

#include <algorithm>

namespace dyop::motion_internal {
namespace {

SpeedTree::Speeds larger_speeds(const SpeedTree::Speeds& x, const SpeedTree::Speeds& y) {
  return {std::max(x.linear, y.linear), std::max(x.angular, y.angular)};
}

}  // namespace

SpeedTree::SpeedTree(const std::vector<Speeds>& pieces) : nodes_(pieces.size()) {
  nodes_.insert(nodes_.end(), pieces.begin(), pieces.end());
  for (std::size_t i = pieces.size(); i-- > 1;) {
    nodes_[i] = larger_speeds(nodes_[2 * i], nodes_[2 * i + 1]);
  }
}

// Bottom up: at most two nodes of each level.
SpeedTree::Speeds SpeedTree::largest(std::size_t first, std::size_t last) const {
  Speeds largest;
  std::size_t begin = first + nodes_.size() / 2;
  std::size_t end = last + 1 + nodes_.size() / 2;
  for (; begin < end; begin /= 2, end /= 2) {
    if (begin % 2 == 1) largest = larger_speeds(largest, nodes_[begin++]);
    if (end % 2 == 1) largest = larger_speeds(largest, nodes_[--end]);
  }
  return largest;
}

}  // namespace dyop::motion_internal
