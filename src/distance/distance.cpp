#include "dyop/distance/distance.h"

#include <algorithm>

#include "distance/distance_check.h"
#include "distance/distance_traversal.h"
#include "distance/enclosure.h"
#include "dyop/distance/penetration.h"

namespace dyop {
namespace {

using internal::DistanceTraversal;
using internal::ShapeTree;

DistanceStatus status_of(const DistanceTraversal& traversal, Scalar limit) {
  if (traversal.best.is_overlapping) return DistanceStatus::Overlapping;
  if (traversal.lower > limit) return DistanceStatus::FartherThanLimit;
  return traversal.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
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
  internal::require_valid_options(options, "distance");
  const internal::Solids solids{options.solid_a, options.solid_b};
  internal::require_closed("distance", a, b, solids);
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  internal::BoxPairStack stack;
  DistanceTraversal traversal(tree_a, tree_b, X_AB, internal::pose_noise(a, X_WA, b, X_WB),
                              options.upper_limit, stack);
  traversal.absolute_allowance = options.absolute_allowance;
  traversal.relative_allowance = options.relative_allowance;
  traversal.seed(cache.leaf_a, cache.leaf_b);
  traversal.run();

  DistanceResult result;
  result.status = status_of(traversal, options.upper_limit);
  result.statistics = traversal.statistics;
  if (const auto p_W = result.status == DistanceStatus::Overlapping
                           ? std::nullopt
                           : internal::find_enclosed_point(a, X_WA, b, X_WB, solids)) {
    result.status = DistanceStatus::Overlapping;
    result.upper = 0;
    result.p_WCa = result.p_WCb = result.pivot_W = *p_W;
    return result;
  }
  result.lower =
      traversal.best.is_overlapping ? 0 : std::min(traversal.lower, traversal.best.upper);
  result.upper = traversal.best.upper;
  if (result.upper == kInfinity) return result;  // farther than the limit: no piece was looked at
  cache.leaf_a = traversal.leaf_a;
  cache.leaf_b = traversal.leaf_b;
  result.p_WCa = X_WA * traversal.best.p_ACa;
  result.p_WCb = X_WA * traversal.best.p_ACb;
  result.nhat_AB_W = X_WA.rotation() * traversal.best.nhat_AB_A;
  result.feature_a = traversal.best.feature_a;
  result.feature_b = traversal.best.feature_b;
  internal::name_pieces(tree_a, traversal.leaf_a, tree_b, traversal.leaf_b, result);
  result.pivot_W = (result.p_WCa + result.p_WCb) / 2;
  if (options.with_penetration && result.status == DistanceStatus::Overlapping && tree_a.convex() &&
      tree_b.convex()) {
    result.penetration = find_penetration(*tree_a.convex(), X_WA, *tree_b.convex(), X_WB);
  }
  return result;
}

}  // namespace dyop
