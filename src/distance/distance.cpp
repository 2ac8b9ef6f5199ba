// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include "core/assert.h"
#include "core/batch_run.h"
#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "distance/distance_traversal.h"
#include "distance/pivot_seed.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance_result.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop {
namespace {

using distance_internal::are_convex;
using distance_internal::BoxPair;
using distance_internal::DistanceTraversal;
using distance_internal::GjkGoal;
using distance_internal::GjkSeed;
using geometry_internal::extent_beside;
using geometry_internal::ShapeTree;

// --- two convex shapes --------------------------------------------------------------------------

DistanceStatus status_of(const NearestPoints& nearest, Scalar limit) {
  if (nearest.is_overlapping) return DistanceStatus::Overlapping;
  if (nearest.lower > limit) return DistanceStatus::FartherThanMaxDistance;
  return nearest.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
}

struct ConvexPair {
  const ConvexShape& a;
  const RigidPose& X_WA;
  const ConvexShape& b;
  const RigidPose& X_WB;
};

void finish(const ConvexPair& pair, const NearestPoints& nearest, const DistanceOptions& options,
            DistanceResult& result) {
  result.status = status_of(nearest, options.max_distance);
  result.lower = nearest.lower;
  result.upper = nearest.upper;
  result.feature_a = nearest.feature_a;
  result.feature_b = nearest.feature_b;
  result.statistics.leaf_tests = 1;
  if (options.with_penetration && nearest.is_overlapping) {
    result.penetration = find_penetration(pair.a, pair.X_WA, pair.b, pair.X_WB);
  }
}

bool is_centred_ball(const SimpleCore& core) {
  return core.kind == CoreKind::Point && core.is_centred;
}

// core_distance() of two balls about their origins, where the steps from its result to this one
// would cost as much as the distance itself. False, with nothing known, for all other pairs.
bool distance_of_balls(const ConvexPair& pair, const DistanceOptions& options,
                       DistanceResult& result) {
  const SimpleCore& a = pair.a.simple_core();
  const SimpleCore& b = pair.b.simple_core();
  if (!is_centred_ball(a) || !is_centred_ball(b) || options.with_penetration) return false;
  const Vector3& p_WA = pair.X_WA.translation();
  const Vector3& p_WB = pair.X_WB.translation();
  const Vector3 v = p_WB - p_WA;
  const Scalar length = v.norm();
  const Scalar radii = a.rounding_radius + b.rounding_radius;
  const Scalar gap = length - radii;
  const Scalar noise = kPoseNoise * (v.lpNorm<1>() + radii);
  // literal: squares of lengths stay in the range of double; false for NaN and what overlaps.
  if (!(gap > noise && length > 0x1p-400 && length < 0x1p400)) return false;
  result.lower = gap - noise;
  result.upper = gap + noise;
  result.status = result.lower > options.max_distance ? DistanceStatus::FartherThanMaxDistance
                                                      : DistanceStatus::Separated;
  const Scalar inverse = 1 / length;
  for (int k = 0; k < 3; ++k) {  // in one pass: less goes through memory
    const Scalar along = v[k] * inverse;
    result.nhat_AB_W[k] = along;
    result.p_WCa[k] = p_WA[k] + a.rounding_radius * along;
    result.p_WCb[k] = p_WB[k] - b.rounding_radius * along;
  }
  result.feature_a = result.feature_b = {FeatureKind::Vertex, {0}};
  result.statistics.leaf_tests = 1;
  return true;
}

// In the axes of the world, from A's origin on: no pose is inverted, and nothing grows with the
// distance from the world's origin.
bool closed_form(const ConvexPair& pair, const DistanceOptions& options, DistanceResult& result) {
  if (distance_of_balls(pair, options, result)) return true;
  const Vector3& p_WA = pair.X_WA.translation();
  NearestPoints nearest;
  if (!distance_internal::core_distance(
          pair.a.simple_core(), pair.b.simple_core(),
          {pair.X_WA.rotation(), pair.X_WB.rotation(), pair.X_WB.translation() - p_WA}, nearest)) {
    return false;
  }
  finish(pair, nearest, options, result);
  result.p_WCa = p_WA + nearest.p_a;
  result.p_WCb = p_WA + nearest.p_b;
  result.nhat_AB_W = nearest.nhat_AB;
  return true;
}

DistanceResult by_gjk(const ConvexPair& pair, const DistanceOptions& options, const GjkGoal& goal,
                      GjkSeed& seed) {
  DistanceResult result;
  const Scalar noise = distance_internal::pose_noise(pair.a, pair.X_WA, pair.b, pair.X_WB);
  const RigidPose X_AB = pair.X_WA.inverse() * pair.X_WB;
  GjkResult nearest = distance_internal::gjk_distance(pair.a, pair.b, X_AB, goal, seed);
  // An error of the poses changes the distance by no more than itself.
  nearest.lower = std::max(0.0, nearest.lower - noise);
  nearest.upper += noise;
  finish(pair, nearest, options, result);
  result.p_WCa = pair.X_WA * nearest.p_a;
  result.p_WCb = pair.X_WA * nearest.p_b;
  result.nhat_AB_W = pair.X_WA.rotation() * nearest.nhat_AB;
  result.statistics.gjk_iterations = nearest.iterations;
  return result;
}

// The support point of a vertex number from outside, if the shape has such a vertex.
std::optional<SupportPoint> vertex_of(const ConvexShape& shape, std::int32_t number) {
  const TriangleMesh* surface = shape.core_surface();
  if (!surface || number < 0) return std::nullopt;
  const std::span<const Vector3> vertices = surface->vertices();
  if (static_cast<std::size_t>(number) >= vertices.size()) return std::nullopt;
  return SupportPoint{vertices[static_cast<std::size_t>(number)], number};
}

GjkSeed seed_from(const DistanceCache::Vertices& vertices, const ConvexPair& pair) {
  GjkSeed seed;
  for (std::size_t i = 0; i < std::min(vertices.count, seed.a.size()); ++i) {
    const auto a = vertex_of(pair.a, vertices.a[i]);
    const auto b = vertex_of(pair.b, vertices.b[i]);
    if (!a || !b) return {};
    seed.a[i] = *a;
    seed.b[i] = *b;
    ++seed.count;
  }
  return seed;
}

void keep(const GjkSeed& seed, DistanceCache::Vertices& vertices) {
  vertices.count = 0;
  for (std::size_t i = 0; i < seed.count; ++i) {
    if (!seed.a[i].vertex || !seed.b[i].vertex) return;
    vertices.a[i] = *seed.a[i].vertex;
    vertices.b[i] = *seed.b[i].vertex;
  }
  vertices.count = seed.count;
}

DistanceResult convex_distance(const ConvexPair& pair, const DistanceOptions& options,
                               DistanceCache& cache) {
  distance_internal::require_valid_options(options, "distance");
  DistanceResult result;
  if (closed_form(pair, options, result)) return result;
  GjkSeed seed = seed_from(cache.vertices, pair);
  result = by_gjk(pair, options, {}, seed);
  keep(seed, cache.vertices);
  return result;
}

ConvexPair as_convex(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  return {static_cast<const ConvexShape&>(a), X_WA, static_cast<const ConvexShape&>(b), X_WB};
}

// --- everything else ----------------------------------------------------------------------------

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
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  const Scalar apart = X_AB.translation().norm();
  const ShapeTree tree_a(a, extent_beside(a, b, apart));
  const ShapeTree tree_b(b, extent_beside(b, a, apart));
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
  if (are_convex(a, b)) return convex_distance(as_convex(a, X_WA, b, X_WB), options, cache);
  return query(a, X_WA, b, X_WB, options, cache,
               [&](DistanceTraversal& traversal, const auto&...) { traverse(traversal, cache); });
}

namespace distance_internal {

std::optional<DistanceResult> distance_until(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                             const RigidPose& X_WB, const DistanceOptions& options,
                                             DistanceCache& cache, Interrupt& interrupt) {
  if (are_convex(a, b)) {
    if (interrupt.is_over()) return std::nullopt;
    return convex_distance(as_convex(a, X_WA, b, X_WB), options, cache);
  }
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
  if (are_convex(a, b)) {
    require_valid_options(options, "distance");
    const GjkGoal goal{.apart = options.max_distance, .share = kInfinity};
    const ConvexPair pair = as_convex(a, X_WA, b, X_WB);
    DistanceResult result;
    if (closed_form(pair, options, result)) return result;
    return by_gjk(pair, options, goal, seed.supports);
  }
  return query(
      a, X_WA, b, X_WB, options, seed.pieces,
      [&](DistanceTraversal& traversal, const auto&...) { traverse(traversal, seed.pieces); });
}

}  // namespace distance_internal

void distance_batch(std::span<const DistanceQuery> queries, std::span<DistanceResult> results,
                    const BatchOptions& options) {
  DYOP_REQUIRE(queries.size() == results.size(), "distance: ", queries.size(),
               " queries, but space for ", results.size(), " results");
  for (std::size_t i = 0; i < queries.size(); ++i) {
    DYOP_REQUIRE(queries[i].a && queries[i].b, "query ", i, ": a shape is missing");
    distance_internal::require_valid_options(queries[i].options, "query ", i);
  }
  std::fill(results.begin(), results.end(), DistanceResult());
  core_internal::run_batch(queries.size(), options, [&](std::size_t index, std::size_t) {
    const DistanceQuery& query = queries[index];
    DistanceCache cold;
    results[index] = distance(*query.a, query.X_WA, *query.b, query.X_WB, query.options,
                              query.cache ? *query.cache : cold);
  });
}

std::string_view name_of(DistanceStatus status) {
  switch (status) {
    case DistanceStatus::NotRun:
      return "NotRun";
    case DistanceStatus::Separated:
      return "Separated";
    case DistanceStatus::Overlapping:
      return "Overlapping";
    case DistanceStatus::FartherThanMaxDistance:
      return "FartherThanMaxDistance";
    case DistanceStatus::Inconclusive:
      return "Inconclusive";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, DistanceStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const DistanceResult& result) {
  return out << result.status << ": " << result.lower << " <= distance <= " << result.upper;
}

}  // namespace dyop
