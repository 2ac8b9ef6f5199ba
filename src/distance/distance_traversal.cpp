// SPDX-License-Identifier: BSD-3-Clause
#include "distance/distance_traversal.h"

#include <array>
#include <limits>

namespace dyop::distance_internal {

void DistanceTraversal::visit_leaves(std::int32_t a, std::int32_t b) {
  ++statistics.leaf_tests;
  const PieceDistance piece = piece_distance(a_, a, b_, b, X_AB_, noise_);
  statistics.gjk_iterations += piece.gjk_iterations;
  lower = std::min(lower, piece.lower);
  if (piece.upper < best.upper) {
    best = piece;
    leaf_a = a;
    leaf_b = b;
  }
}

// Pushes the pairs of the larger box's parts with the other box, nearest on top.
void DistanceTraversal::open(const BoxPair& pair) {
  const bool opens_a = opens_first(a_, pair.a, b_, pair.b);
  const ShapeTree& tree = opens_a ? a_ : b_;
  const std::int32_t child = tree.child(opens_a ? pair.a : pair.b);
  const int count = tree.node(child).count();
  FacingBox other = opens_a ? facing_box(b_.box(pair.b), X_AB_) : facing_box(a_.box(pair.a), X_BA_);
  other.is_of_cores = radii_ > 0;
  std::array<Scalar, BoxGroup::kWidth> gaps;
  box_gaps_(tree.rows(child), count, other, box_noise_, gaps.data());
  statistics.box_tests += count;
  const auto first = stack_.size();
  for (int column = 0; column < count; ++column) {
    const Scalar gap = std::max(pair.gap, std::max(gaps[std::size_t(column)], 0.0) - radii_);
    if (gap > cutoff()) {
      pass_over(gap);
      continue;
    }
    const std::int32_t part = ShapeTree::box_number(child, column);
    stack_.push_back({gap, opens_a ? part : pair.a, opens_a ? pair.b : part});
  }
  // Insertion sort of at most eight, with the nearest on top.
  for (auto k = first + 1; k < stack_.size(); ++k) {
    const BoxPair moved = stack_[k];
    auto place = k;
    for (; place > first && stack_[place - 1].gap < moved.gap; --place) {
      stack_[place] = stack_[place - 1];
    }
    stack_[place] = moved;
  }
}

void DistanceTraversal::seed(std::int32_t box_a, std::int32_t box_b) {
  if (a_.has_leaf(box_a) && b_.has_leaf(box_b)) visit_leaves(box_a, box_b);
}

void DistanceTraversal::run() {
  start();
  run_portion(std::numeric_limits<std::int64_t>::max());
}

void DistanceTraversal::start(std::span<const BoxPair> first) {
  stack_.clear();
  if (!is_found()) stack_.assign(first.begin(), first.end());
}

bool DistanceTraversal::run_portion(std::int64_t max_box_pairs) {
  for (; !stack_.empty(); --max_box_pairs) {
    if (max_box_pairs <= 0) return false;
    const BoxPair pair = stack_.back();
    stack_.pop_back();
    ++box_pairs;
    if (pair.gap > cutoff()) {
      pass_over(pair.gap);
      continue;
    }
    if (a_.is_leaf(pair.a) && b_.is_leaf(pair.b)) {
      visit_leaves(pair.a, pair.b);
      if (is_found()) return true;
    } else {
      open(pair);
    }
  }
  return true;
}

}  // namespace dyop::distance_internal
