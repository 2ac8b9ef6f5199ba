// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/obstacle_tree.h"

#include <algorithm>
#include <span>
#include <utility>

namespace dyop::toi_internal {
namespace {

// Half the surface: how likely a query is to meet a box.
Scalar area(const AlignedBox& box) {
  const Vector3 s = box.sizes();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

// Below this number of items a new tree is not worth it.
constexpr std::size_t kFewest = 64;

}  // namespace

std::int32_t ObstacleTree::new_node() {
  if (free_.empty()) {
    nodes_.emplace_back();
    return static_cast<std::int32_t>(nodes_.size()) - 1;
  }
  const std::int32_t number = free_.back();
  free_.pop_back();
  at(number) = {};
  return number;
}

// Goes down as long as a child may be a cheaper place: the cost of a place is the area of the new
// box there plus what all boxes above it grow by.
std::int32_t ObstacleTree::best_sibling(const AlignedBox& box) const {
  std::int32_t best = root_;
  Scalar best_cost = kInfinity;
  Scalar grown = 0;  // by the boxes above
  std::int32_t current = root_;
  while (true) {
    const Node& here = node(current);
    const Scalar joined = area(here.box.merged(box));
    if (grown + joined < best_cost) {
      best_cost = grown + joined;
      best = current;
    }
    if (here.is_leaf()) return best;
    grown += joined - area(here.box);
    // No place below costs less than this.
    if (!(grown + area(box) < best_cost)) return best;
    const auto growth = [&](std::int32_t child) {
      return area(node(child).box.merged(box)) - area(node(child).box);
    };
    current =
        growth(here.children[1]) < growth(here.children[0]) ? here.children[1] : here.children[0];
  }
}

void ObstacleTree::replace_child(std::int32_t parent, std::int32_t from, std::int32_t to) {
  at(to).parent = parent;
  if (parent == kNone) {
    root_ = to;
    return;
  }
  auto& children = at(parent).children;
  children[children[0] == from ? 0 : 1] = to;
}

void ObstacleTree::join(std::int32_t leaf, std::int32_t sibling) {
  const std::int32_t parent = new_node();
  replace_child(at(sibling).parent, sibling, parent);
  at(parent).children = {sibling, leaf};
  at(sibling).parent = at(leaf).parent = parent;
  mend_up(parent);
}

void ObstacleTree::fit(std::int32_t number) {
  Node& inner = at(number);
  inner.box = node(inner.children[0]).box.merged(node(inner.children[1]).box);
}

// Exchanges a child with a child of the other one, where that makes the other's box smallest.
void ObstacleTree::rotate(std::int32_t number) {
  Scalar best_gain = 0;
  std::int32_t best_child = kNone;
  std::int32_t best_grandchild = kNone;
  for (const int side : {0, 1}) {
    const std::int32_t child = at(number).children[std::size_t(side)];
    const Node& other = node(at(number).children[std::size_t(1 - side)]);
    if (other.is_leaf()) continue;
    for (const int place : {0, 1}) {
      const std::int32_t stays = other.children[std::size_t(1 - place)];
      const Scalar gain = area(other.box) - area(node(stays).box.merged(node(child).box));
      if (!(gain > best_gain)) continue;
      best_gain = gain;
      best_child = child;
      best_grandchild = other.children[std::size_t(place)];
    }
  }
  if (best_child == kNone) return;
  const std::int32_t other = at(best_grandchild).parent;
  replace_child(number, best_child, best_grandchild);
  replace_child(other, best_grandchild, best_child);
  fit(other);
}

void ObstacleTree::mend_up(std::int32_t number) {
  for (; number != kNone; number = at(number).parent) {
    fit(number);
    rotate(number);
  }
}

std::int32_t ObstacleTree::insert(const AlignedBox& box, std::uint32_t number) {
  const std::int32_t leaf = new_node();
  at(leaf).box = box;
  at(leaf).number = number;
  ++item_count_;
  if (root_ == kNone) {
    root_ = leaf;
  } else {
    join(leaf, best_sibling(box));
  }
  if (item_count_ > 2 * built_count_ + kFewest) rebuild();
  return leaf;
}

void ObstacleTree::remove(std::int32_t leaf) {
  const std::int32_t parent = at(leaf).parent;
  free_.push_back(leaf);
  --item_count_;
  if (parent == kNone) {
    root_ = kNone;
    return;
  }
  const auto& children = at(parent).children;
  const std::int32_t sibling = children[children[0] == leaf ? 1 : 0];
  const std::int32_t above = at(parent).parent;
  replace_child(above, parent, sibling);
  free_.push_back(parent);
  mend_up(above);
}

// Leaves stay where they are; the inner nodes are dealt out again.
void ObstacleTree::rebuild() {
  std::vector<std::int32_t> leaves;
  std::vector<std::int32_t> inner;
  std::vector<std::int32_t> open{root_};
  while (!open.empty()) {
    const std::int32_t number = open.back();
    open.pop_back();
    if (at(number).is_leaf()) {
      leaves.push_back(number);
      continue;
    }
    inner.push_back(number);
    for (const std::int32_t child : at(number).children) open.push_back(child);
  }
  built_count_ = leaves.size();
  struct Part {
    std::span<std::int32_t> leaves;
    std::int32_t parent;
    std::size_t side;
  };
  std::vector<std::int32_t> made;  // parents before their children
  std::vector<Part> parts{{leaves, kNone, 0}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    const bool is_leaf = part.leaves.size() == 1;
    const std::int32_t number = is_leaf ? part.leaves[0] : inner[made.size()];
    at(number).parent = part.parent;
    (part.parent == kNone ? root_ : at(part.parent).children[part.side]) = number;
    if (is_leaf) continue;
    made.push_back(number);
    AlignedBox centers;
    for (const std::int32_t leaf : part.leaves) centers.extend(node(leaf).box.center());
    Eigen::Index axis = 0;
    centers.sizes().maxCoeff(&axis);
    const auto key = [&](std::int32_t leaf) {
      return std::make_pair(node(leaf).box.center()[axis], node(leaf).number);
    };
    const std::size_t middle = part.leaves.size() / 2;
    std::nth_element(part.leaves.begin(), part.leaves.begin() + std::ptrdiff_t(middle),
                     part.leaves.end(),
                     [&](std::int32_t x, std::int32_t y) { return key(x) < key(y); });
    parts.push_back({part.leaves.first(middle), number, 0});
    parts.push_back({part.leaves.subspan(middle), number, 1});
  }
  for (auto it = made.rbegin(); it != made.rend(); ++it) fit(*it);
}

}  // namespace dyop::toi_internal
