// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/near_triangles.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "distance/leaf_pairs.h"
#include "distance/piece_distance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

using distance_internal::BoxPair;
using distance_internal::LeafPairSearch;
using geometry_internal::ShapeTree;

void require_valid(const char* query, Scalar max_distance) {
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity, query,
               ": max_distance must be finite and >= 0, not ", max_distance);
}

// `accepts` decides which pairs of triangles count at all.
template <typename Accepts>
NearTriangleList list_pairs(const LeafPairSearch& search, Scalar piece_noise,
                            const TrianglePairLimits& limits, const Accepts& accepts) {
  NearTriangleList list;
  distance_internal::BoxPairStack stack{distance_internal::kRootPair};
  const auto visit = [&](const BoxPair& leaves) {
    const std::int32_t a = search.a.triangle(leaves.a);
    const std::int32_t b = search.b.triangle(leaves.b);
    if (!accepts(a, b)) return;
    const distance_internal::PieceDistance found = distance_internal::piece_distance(
        search.a, leaves.a, search.b, leaves.b, search.X_AB, piece_noise);
    if (found.lower > search.reach) return;
    if (list.pairs.size() < limits.max_pairs) {
      list.pairs.push_back({a, b, found.lower, found.upper});
    } else {
      list.is_complete = false;
    }
  };
  const auto is_over = [&](bool /*are_leaves*/) {
    return !list.is_complete || limits.stop.stop_requested();
  };
  distance_internal::visit_leaf_pairs(search, stack, visit, is_over,
                                      [](const BoxPair&) { return true; });
  list.is_complete = list.is_complete && stack.empty();
  std::sort(list.pairs.begin(), list.pairs.end(),
            [](const NearTriangles& x, const NearTriangles& y) {
              return std::tie(x.a, x.b) < std::tie(y.a, y.b);
            });
  return list;
}

bool share_a_vertex(const TriangleIndices& s, const TriangleIndices& t) {
  return std::any_of(s.begin(), s.end(), [&](std::int32_t vertex) {
    return std::find(t.begin(), t.end(), vertex) != t.end();
  });
}

}  // namespace

NearTriangleList near_triangles(const TriangleMesh& a, const RigidPose& X_WA, const TriangleMesh& b,
                                const RigidPose& X_WB, Scalar max_distance,
                                const TrianglePairLimits& limits) {
  require_valid("near_triangles", max_distance);
  const ShapeTree tree_a(a);
  const ShapeTree tree_b(b);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  const Scalar noise = distance_internal::pose_noise(a, X_WA, b, X_WB);
  return list_pairs({tree_a, tree_b, X_AB, noise, max_distance}, noise, limits,
                    [](std::int32_t, std::int32_t) { return true; });
}

NearTriangleList near_own_triangles(const TriangleMesh& mesh, Scalar max_distance,
                                    const TrianglePairLimits& limits) {
  require_valid("near_own_triangles", max_distance);
  const ShapeTree tree(mesh);
  const RigidPose same;
  // Boxes are computed with, triangles are where they are.
  const Scalar noise = distance_internal::pose_noise(mesh, same, mesh, same);
  const auto triangles = mesh.triangles();
  return list_pairs(
      {tree, tree, same, noise, max_distance}, 0, limits, [&](std::int32_t s, std::int32_t t) {
        return s < t && !share_a_vertex(triangles[std::size_t(s)], triangles[std::size_t(t)]);
      });
}

}  // namespace dyop
