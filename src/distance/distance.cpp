// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.h"
#include "distance/distance_check.h"
#include "distance/distance_traversal.h"
#include "distance/distance_until.h"
#include "distance/enclosure.h"
#include "distance/pivot_seed.h"
#include "dyop/distance/penetration.h"

namespace dyop {
namespace {

using distance_internal::BoxPair;
using distance_internal::DistanceTraversal;
using geometry_internal::ShapeTree;

DistanceStatus status_of(const DistanceTraversal& traversal, Scalar limit) {
  if (traversal.best.is_overlapping) return DistanceStatus::Overlapping;
  if (traversal.lower > limit) return DistanceStatus::FartherThanMaxDistance;
  return traversal.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
}

// One query: shapes, poses and options, and how the traversal is to begin.
template <typename Search>
DistanceResult query(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                     const DistanceOptions& options, DistanceCache& cache, const Search& search) {
  distance_internal::require_valid_options(options, "distance");
  const distance_internal::Solids solids{options.solid_a, options.solid_b};
  distance_internal::require_closed("distance", a, b, solids);
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  const Scalar noise = distance_internal::pose_noise(a, X_WA, b, X_WB);
  cache.stack.clear();
  DistanceTraversal traversal(tree_a, tree_b, X_AB, noise, options.max_distance, cache.stack);
  traversal.absolute_tolerance = options.absolute_tolerance;
  traversal.relative_tolerance = options.relative_tolerance;
  search(traversal, tree_a, tree_b, X_AB, noise);

  DistanceResult result;
  result.status = status_of(traversal, options.max_distance);
  result.statistics = traversal.statistics;
  if (const auto p_W = result.status == DistanceStatus::Overlapping
                           ? std::nullopt
                           : distance_internal::find_enclosed_point(a, X_WA, b, X_WB, solids)) {
    result.status = DistanceStatus::Overlapping;
    result.upper = 0;
    result.p_WCa = result.p_WCb = *p_W;
    return result;
  }
  const distance_internal::PieceDistance& best = traversal.best;
  result.lower = best.is_overlapping ? 0 : std::min(traversal.lower, best.upper);
  result.upper = best.upper;
  DYOP_ASSERT(result.lower <= result.upper, result.lower, ' ', result.upper);
  if (result.upper == kInfinity) return result;  // beyond the limit: no piece was examined
  cache.nearest = {traversal.leaf_a, traversal.leaf_b};
  const Scalar lower = result.lower;
  static_cast<WitnessPair&>(result) = distance_internal::witness_pair(
      best, tree_a, traversal.leaf_a, tree_b, traversal.leaf_b, X_WA);
  result.lower = lower;
  if (options.with_penetration && result.status == DistanceStatus::Overlapping && tree_a.convex() &&
      tree_b.convex()) {
    result.penetration = find_penetration(*tree_a.convex(), X_WA, *tree_b.convex(), X_WB);
  }
  return result;
}

void traverse(DistanceTraversal& traversal, const DistanceCache& cache) {
  if (cache.nearest) traversal.seed(cache.nearest->a, cache.nearest->b);
  traversal.run();
}

}  // namespace

DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options) {
  DistanceCache cache;
  return distance(a, X_WA, b, X_WB, options, cache);
}

DistanceResult distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache) {
  return query(a, X_WA, b, X_WB, options, cache,
               [&](DistanceTraversal& traversal, const auto&...) { traverse(traversal, cache); });
}

namespace distance_internal {

std::optional<DistanceResult> distance_until(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                             const RigidPose& X_WB, const DistanceOptions& options,
                                             DistanceCache& cache, Interrupt& interrupt) {
  constexpr std::int64_t kPortion = 8;
  bool is_through = false;
  const auto search = [&](DistanceTraversal& traversal, const auto&...) {
    if (cache.nearest) traversal.seed(cache.nearest->a, cache.nearest->b);
    traversal.start();
    while (!is_through && !interrupt.is_over()) is_through = traversal.run_portion(kPortion);
  };
  const DistanceResult result = query(a, X_WA, b, X_WB, options, cache, search);
  if (!is_through) return std::nullopt;
  return result;
}

DistanceResult listed_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                               const RigidPose& X_WB, const DistanceOptions& options,
                               std::span<const BoxPair> pairs, PairSeed& seed) {
  const auto search = [&](DistanceTraversal& traversal, const auto&...) {
    traversal.lower = std::nextafter(options.max_distance, kInfinity);
    traversal.start(pairs);
    traversal.run_portion(std::numeric_limits<std::int64_t>::max());
  };
  return query(a, X_WA, b, X_WB, options, seed.pieces, search);
}

DistanceResult seeded_distance(const Shape& a, const RigidPose& X_WA, const Shape& b,
                               const RigidPose& X_WB, const DistanceOptions& options,
                               PairSeed& seed) {
  const auto search = [&](DistanceTraversal& traversal, const ShapeTree& tree_a,
                          const ShapeTree& tree_b, const RigidPose& X_AB, Scalar noise) {
    if (!tree_a.convex() || !tree_b.convex()) {
      traverse(traversal, seed.pieces);
      return;
    }
    const GjkGoal goal{.apart = options.max_distance, .share = kInfinity};
    traversal.best = piece_distance(tree_a, ShapeTree::kRoot, tree_b, ShapeTree::kRoot, X_AB, noise,
                                    goal, seed.supports);
    traversal.lower = traversal.best.lower;
    traversal.statistics.leaf_tests = 1;
    traversal.statistics.gjk_iterations = traversal.best.gjk_iterations;
  };
  return query(a, X_WA, b, X_WB, options, seed.pieces, search);
}

}  // namespace distance_internal

}  // namespace dyop
