// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "distance/distance_traversal.h"
#include "toi/deforming/deforming_sides.h"

namespace dyop::internal {

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
  DeformingTraversal(const DeformingSide& a, const SideB& b, Scalar noise, Scalar max_distance,
                     BoxPairStack& stack)
      : a_(a), b_(b), noise_(noise), max_distance_(max_distance), stack_(stack) {}

  /// As in DistanceTraversal.
  void start();
  bool run_portion(std::int64_t max_box_pairs);

  /// Ends at the first pair of triangles for which the middle of the bounds is below this.
  Scalar sought_middle = -kInfinity;

  PieceDistance best;
  DistanceStatistics statistics;
  std::int64_t box_pairs = 0;  ///< popped from the stack

 private:
  Scalar cutoff() const { return std::min(best.upper, max_distance_); }
  bool is_found() const { return best.is_overlapping || best.middle() < sought_middle; }
  void open(const BoxPair& pair);

  const DeformingSide& a_;
  const SideB& b_;
  const Scalar noise_;
  const Scalar max_distance_;
  BoxPairStack& stack_;
};

}  // namespace dyop::internal
