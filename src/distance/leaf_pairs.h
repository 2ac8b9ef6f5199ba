// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "core/tolerance.h"
#include "distance/distance_traversal.h"
#include "hierarchy/box_gaps.h"

namespace dyop::distance_internal {

/// Which pairs of leaves of two trees are sought: those at most `reach` apart. `noise`: allowance
/// for rounding in a distance.
template <typename Tree>
struct LeafSearch {
  const Tree& a;
  const Tree& b;
  const RigidPose& X_AB;
  Scalar noise = 0;
  Scalar reach = 0;
};
using LeafPairSearch = LeafSearch<ShapeTree>;

/// Calls visit(pair of leaves) for all below the pairs of boxes on the stack that may be within
/// reach and for which is_sought(pair of boxes) holds on every level down to them. Ends early when
/// is_over(are_leaves), asked before each pair, says so.
template <typename Tree, typename Visit, typename IsOver, typename IsSought>
void visit_leaf_pairs(const LeafSearch<Tree>& search, BoxPairStack& stack, const Visit& visit,
                      const IsOver& is_over, const IsSought& is_sought) {
  const BoxGapsKernel box_gaps = box_gaps_kernel(best_instruction_set());
  const Scalar box_noise = search.noise * (kStepNoise / kPoseNoise);
  const Scalar radii = search.a.rounding() + search.b.rounding();
  const RigidPose X_BA = search.X_AB.inverse();
  while (!stack.empty()) {
    const BoxPair pair = stack.back();
    const bool are_leaves = search.a.is_leaf(pair.a) && search.b.is_leaf(pair.b);
    if (is_over(are_leaves)) return;
    stack.pop_back();
    if (are_leaves) {
      visit(pair);
      continue;
    }
    const bool opens_a = opens_first(search.a, pair.a, search.b, pair.b);
    const Tree& tree = opens_a ? search.a : search.b;
    const std::int32_t child = tree.child(opens_a ? pair.a : pair.b);
    const int count = tree.node(child).count();
    const FacingBox other = opens_a ? facing_box(search.b.box(pair.b), search.X_AB)
                                    : facing_box(search.a.box(pair.a), X_BA);
    std::array<Scalar, BoxGroup::kWidth> gaps;
    box_gaps(tree.rows(child), count, other, box_noise, gaps.data());
    for (int column = 0; column < count; ++column) {
      const Scalar gap = gaps[std::size_t(column)] - radii;
      if (gap > search.reach) continue;
      const std::int32_t part = ShapeTree::box_number(child, column);
      const BoxPair next{gap, opens_a ? part : pair.a, opens_a ? pair.b : part};
      if (is_sought(next)) stack.push_back(next);
    }
  }
}

}  // namespace dyop::distance_internal
