// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include "distance/distance_traversal.h"
#include "toi/deforming/deforming_sides.h"

namespace dyop::toi_internal {

/// Certified distance of two triangles at the current time of the sides, in world. Features have
/// the meshes' vertex numbers.
/// @param noise Widens both bounds.
template <typename SideB>
PieceDistance leaf_distance(const DeformingSide& a, std::int32_t leaf_a, const SideB& b,
                            std::int32_t leaf_b, Scalar noise);

/// The counterpart of DistanceTraversal: depth-first branch and bound over pairs of boxes of a
/// deforming mesh and a side of either kind, at their current time.
template <typename SideB>
class DeformingTraversal {
 public:
  /// @param first What it starts with: by default, the roots.
  DeformingTraversal(const DeformingSide& a, const SideB& b, Scalar noise, Scalar max_distance,
                     BoxPairStack& stack, std::span<const BoxPair> first = {&kRootPair, 1})
      : a_(a), b_(b), noise_(noise), max_distance_(max_distance), stack_(stack), first_(first) {}

  /// As in DistanceTraversal.
  void seed(std::int32_t leaf_a, std::int32_t leaf_b);
  void start();
  bool run_portion(std::int64_t max_box_pairs);

  /// Visits every pair of triangles not proven to be farther apart than the limit, until
  /// visit(piece, leaf of A, leaf of B) returns false.
  template <typename Visit>
  void for_each_leaf_pair(const Visit& visit);

  /// Ends at the first pair of triangles for which the middle of the bounds is below this.
  Scalar sought_middle = -kInfinity;

  PieceDistance best;
  std::int32_t leaf_a = 0;
  std::int32_t leaf_b = 0;
  Scalar lower =
      kInfinity;  ///< of the whole pair: least bound of all that was left out or measured
  DistanceStatistics statistics;
  std::int64_t box_pairs = 0;  ///< popped from the stack

 private:
  Scalar cutoff() const { return std::min(best.upper, max_distance_); }
  bool is_found() const { return best.is_overlapping || best.middle() < sought_middle; }
  void visit_leaves(std::int32_t a, std::int32_t b);
  void open(const BoxPair& pair);

  const DeformingSide& a_;
  const SideB& b_;
  const Scalar noise_;
  const Scalar max_distance_;
  BoxPairStack& stack_;
  const std::span<const BoxPair> first_;
};

template <typename SideB>
template <typename Visit>
void DeformingTraversal<SideB>::for_each_leaf_pair(const Visit& visit) {
  stack_.assign(first_.begin(), first_.end());
  while (!stack_.empty()) {
    const BoxPair pair = stack_.back();
    stack_.pop_back();
    if (!a_.is_leaf(pair.a) || !b_.is_leaf(pair.b)) {
      open(pair);
    } else if (!visit(leaf_distance(a_, pair.a, b_, pair.b, noise_), pair.a, pair.b)) {
      return;
    }
  }
}

}  // namespace dyop::toi_internal
