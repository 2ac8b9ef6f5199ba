// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_distance.h"

#include <algorithm>
#include <optional>

#include "dyop/core/error.h"
#include "toi/deforming/deforming_traversal.h"
#include "toi/deforming/standing_pair.h"

namespace dyop {
namespace {

using distance_internal::PieceDistance;
using toi_internal::DeformingTraversal;
using toi_internal::RigidSide;
using toi_internal::StandingPair;

void require_fraction(Scalar s) {
  DYOP_REQUIRE(s >= 0 && s <= 1, "the fraction of a deforming mesh's interval must be in [0, 1], ",
               "not ", s);
}

WitnessPair witness_of(const PieceDistance& piece, std::int32_t triangle_a,
                       std::int32_t triangle_b) {
  return {piece.lower,     piece.upper, piece.p_a,  piece.p_b,    piece.nhat_AB, piece.feature_a,
          piece.feature_b, triangle_a,  triangle_b, std::nullopt, std::nullopt};
}

}  // namespace

DistanceResult distance(const DeformingMesh& a, Scalar s, const TriangleMesh& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache) {
  require_fraction(s);
  DYOP_REQUIRE(options.max_distance >= 0, "distance: max_distance must be >= 0, not ",
               options.max_distance);
  const StandingPair sides(a, s, b, X_WB);
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, options.max_distance,
                                          cache.stack);
  const auto& seed = cache.nearest;
  if (seed && sides.a.has_leaf(seed->a) && sides.b.has_leaf(seed->b)) {
    traversal.seed(seed->a, seed->b);
  }
  traversal.start();
  traversal.run_portion(std::numeric_limits<std::int64_t>::max());

  DistanceResult result;
  result.statistics = traversal.statistics;
  const PieceDistance& best = traversal.best;
  if (best.upper < kInfinity) {
    cache.nearest = {traversal.leaf_a, traversal.leaf_b};
    static_cast<WitnessPair&>(result) =
        witness_of(best, sides.a.triangle(traversal.leaf_a), sides.b.triangle(traversal.leaf_b));
  }
  result.lower = best.is_overlapping ? 0 : std::min(traversal.lower, result.upper);
  if (best.is_overlapping) {
    result.status = DistanceStatus::Overlapping;
  } else if (result.lower > options.max_distance) {
    result.status = DistanceStatus::FartherThanMaxDistance;
  } else {
    result.status = result.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
  }
  return result;
}

void find_near_pairs(const DeformingMesh& a, Scalar s, const TriangleMesh& b, const RigidPose& X_WB,
                     Scalar max_distance, std::size_t limit, DistanceCache& cache,
                     std::vector<WitnessPair>& pairs) {
  require_fraction(s);
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity,
               "find_near_pairs: max_distance must be finite and >= 0, not ", max_distance);
  pairs.clear();
  const StandingPair sides(a, s, b, X_WB);
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, max_distance, cache.stack);
  traversal.for_each_leaf_pair(
      [&](const PieceDistance& piece, std::int32_t leaf_a, std::int32_t leaf_b) {
        if (piece.lower <= max_distance) {
          pairs.push_back(witness_of(piece, sides.a.triangle(leaf_a), sides.b.triangle(leaf_b)));
        }
        return pairs.size() < limit;
      });
}

}  // namespace dyop
