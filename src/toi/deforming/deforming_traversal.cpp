// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/deforming_traversal.h"

#include <algorithm>

#include "dyop/distance/triangle_distance.h"
#include "hierarchy/split_tree.h"

namespace dyop::toi_internal {

template <typename SideB>
PieceDistance leaf_distance(const DeformingSide& a, std::int32_t leaf_a, const SideB& b,
                            std::int32_t leaf_b, Scalar noise) {
  const auto indices = [](const auto& side, std::int32_t leaf) {
    return side.triangles()[static_cast<std::size_t>(side.triangle(leaf))];
  };
  PieceDistance result{triangle_distance(a.triangle_W(leaf_a), b.triangle_W(leaf_b)), 0};
  result.lower = std::max(0.0, result.lower - noise);
  result.upper += noise;
  result.feature_a = mesh_feature(result.feature_a, indices(a, leaf_a));
  result.feature_b = mesh_feature(result.feature_b, indices(b, leaf_b));
  return result;
}

template <typename SideB>
void DeformingTraversal<SideB>::visit_leaves(std::int32_t a, std::int32_t b) {
  ++statistics.leaf_tests;
  const PieceDistance piece = leaf_distance(a_, a, b_, b, noise_);
  lower = std::min(lower, piece.lower);
  if (!(piece.upper < best.upper)) return;
  best = piece;
  leaf_a = a;
  leaf_b = b;
}

template <typename SideB>
void DeformingTraversal<SideB>::seed(std::int32_t leaf_a_in, std::int32_t leaf_b_in) {
  visit_leaves(leaf_a_in, leaf_b_in);
}

template <typename SideB>
void DeformingTraversal<SideB>::start() {
  stack_.clear();
  if (!is_found()) stack_.assign(first_.begin(), first_.end());
}

template <typename SideB>
bool DeformingTraversal<SideB>::run_portion(std::int64_t max_box_pairs) {
  for (; !stack_.empty(); --max_box_pairs) {
    if (max_box_pairs <= 0) return false;
    const BoxPair pair = stack_.back();
    stack_.pop_back();
    ++box_pairs;
    if (pair.gap > cutoff()) {
      lower = std::min(lower, pair.gap);
      continue;
    }
    if (!a_.is_leaf(pair.a) || !b_.is_leaf(pair.b)) {
      open(pair);
      continue;
    }
    visit_leaves(pair.a, pair.b);
    if (is_found()) return true;
  }
  return true;
}

// Pushes the pairs of the larger box's parts with the other box, nearest on top.
template <typename SideB>
void DeformingTraversal<SideB>::open(const BoxPair& pair) {
  const OrientedBox box_a = a_.box_W(pair.a);
  const OrientedBox box_b = b_.box_W(pair.b);
  const bool opens_a =
      !a_.is_leaf(pair.a) &&
      (b_.is_leaf(pair.b) || box_a.half_extents.squaredNorm() >= box_b.half_extents.squaredNorm());
  const int count = opens_a ? a_.part_count(pair.a) : b_.part_count(pair.b);
  statistics.box_tests += count;
  const auto first = static_cast<std::ptrdiff_t>(stack_.size());
  for (int i = 0; i < count; ++i) {
    BoxPair part = pair;
    (opens_a ? part.a : part.b) = opens_a ? a_.part(pair.a, i) : b_.part(pair.b, i);
    const Vector3 n_W = opens_a ? separating_direction(a_.box_W(part.a), box_b)
                                : separating_direction(box_a, b_.box_W(part.b));
    const Scalar gap =
        -b_.box_support(part.b, -n_W).at(0, 0) - a_.box_support(part.a, n_W).at(0, 0) - noise_;
    part.gap = std::max(pair.gap, gap);
    if (part.gap > cutoff()) {
      lower = std::min(lower, part.gap);
    } else {
      stack_.push_back(part);
    }
  }
  std::sort(stack_.begin() + first, stack_.end(),
            [](const BoxPair& x, const BoxPair& y) { return x.gap > y.gap; });
}

template PieceDistance leaf_distance(const DeformingSide&, std::int32_t, const DeformingSide&,
                                     std::int32_t, Scalar);
template PieceDistance leaf_distance(const DeformingSide&, std::int32_t, const RigidSide&,
                                     std::int32_t, Scalar);
template class DeformingTraversal<DeformingSide>;
template class DeformingTraversal<RigidSide>;

}  // namespace dyop::toi_internal
