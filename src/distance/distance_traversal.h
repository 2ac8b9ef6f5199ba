// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/tolerance.h"
#include "distance/piece_distance.h"
#include "dyop/core/batch_options.h"
#include "dyop/core/error.h"
#include "dyop/core/export.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/ray_cast.h"
#include "geometry/shape_tree.h"
#include "hierarchy/box_gaps.h"

namespace dyop::distance_internal {

inline bool are_convex(const Shape& a, const Shape& b) {
  return a.kind() == ShapeKind::Convex && b.kind() == ShapeKind::Convex;
}

using BoxPair = DistanceCache::BoxPair;
using BoxPairStack = std::vector<BoxPair>;

/// Where a traversal of whole trees starts.
inline constexpr BoxPair kRootPair{0, ShapeTree::kRoot, ShapeTree::kRoot};

/// Depth-first branch and bound over pairs of tree boxes, nearest child first.
class DistanceTraversal {
 public:
  DistanceTraversal(const ShapeTree& a, const ShapeTree& b, const RigidPose& X_AB, Scalar noise,
                    Scalar max_distance, BoxPairStack& stack)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        X_BA_(X_AB.inverse()),
        noise_(noise),
        box_noise_(noise * (kStepNoise / kPoseNoise)),
        radii_(a.rounding() + b.rounding()),
        limit_(max_distance),
        box_gaps_(box_gaps_kernel(best_instruction_set())),
        stack_(stack) {}

  /// Examines one pair of pieces first, if these are leaves.
  void seed(std::int32_t leaf_a, std::int32_t leaf_b);
  void run();
  /// The same in portions: start(), then run_portion() until it returns that it is done. Another
  /// traversal of the same shapes, poses and limits can continue with the stack and `best` of this
  /// one.
  void start() {
    const BoxPair root{-radii_, ShapeTree::kRoot, ShapeTree::kRoot};
    start({&root, 1});
  }
  /// Searches only what is below these pairs; farther ones go first.
  void start(std::span<const BoxPair> first);
  bool run_portion(std::int64_t max_box_pairs);

  /// run() ends at the first pair of pieces for which the middle of the bounds is below this.
  Scalar sought_middle = -kInfinity;

  /// How far below best.upper a pair may still be skipped; see DistanceOptions.
  Scalar absolute_tolerance = 0;
  Scalar relative_tolerance = 0;

  PieceDistance best;
  std::int32_t leaf_a = 0;
  std::int32_t leaf_b = 0;
  Scalar lower = kInfinity;  // of both shapes: smallest bound of all pairs pruned or evaluated
  DistanceStatistics statistics;
  std::int64_t box_pairs = 0;  ///< popped from the stack

 private:
  // A pair that is not looked at. Where both are inflated by balls its bound may be negative: it
  // tells which pair is nearer, also among those that the balls reach.
  void pass_over(Scalar gap) { lower = std::min(lower, std::max(gap, Scalar{0})); }
  // Pairs provably farther than this cannot change the answer by more than is allowed.
  Scalar cutoff() const {
    if (!(best.upper < kInfinity)) return limit_;
    return std::min(best.upper - std::max(absolute_tolerance, relative_tolerance * best.upper),
                    limit_);
  }
  bool is_found() const { return best.is_overlapping || best.middle() < sought_middle; }
  void visit_leaves(std::int32_t a, std::int32_t b);
  void open(const BoxPair& pair);

  const ShapeTree& a_;
  const ShapeTree& b_;
  const RigidPose X_AB_;
  const RigidPose X_BA_;
  const Scalar noise_;      // of a point of one shape in the frame of the other
  const Scalar box_noise_;  // of a gap between boxes
  const Scalar radii_;      // of the balls that inflate what the boxes hold
  const Scalar limit_;
  const BoxGapsKernel box_gaps_;
  BoxPairStack& stack_;
};

/// @throws InvalidArgument for options out of range; the message starts with the subject.
template <typename... Subject>
void require_valid_options(const DistanceOptions& options, const Subject&... subject) {
  DYOP_REQUIRE(options.max_distance >= 0, subject..., ": max_distance must be >= 0, not ",
               options.max_distance);
  DYOP_REQUIRE(options.absolute_tolerance >= 0, subject...,
               ": absolute_tolerance must be >= 0, not ", options.absolute_tolerance);
  DYOP_REQUIRE(options.relative_tolerance >= 0 && options.relative_tolerance < 1, subject...,
               ": relative_tolerance must be in [0, 1), not ", options.relative_tolerance);
}

/// @throws InvalidArgument, prefixed with the name of the query, for a ray that ray_cast() refuses.
DYOP_EXPORT void require_valid_ray(const Ray& ray, const char* query);

/// As distance(), unless it is interrupted, which is asked after every few pairs of boxes: then
/// nothing.
DYOP_EXPORT std::optional<DistanceResult> distance_until(const Shape& a, const RigidPose& X_WA,
                                                         const Shape& b, const RigidPose& X_WB,
                                                         const DistanceOptions& options,
                                                         DistanceCache& cache,
                                                         Interrupt& interrupt);

}  // namespace dyop::distance_internal
