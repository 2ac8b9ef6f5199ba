// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stop_token>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// Two triangles, and bounds on their distance.
struct NearTriangles {
  std::int32_t a = 0;
  std::int32_t b = 0;
  Scalar lower = 0;  ///< 0: they touch or cross, up to rounding
  Scalar upper = 0;
};

/// What ends a search for pairs of triangles early.
struct TrianglePairLimits {
  std::size_t max_pairs = std::numeric_limits<std::size_t>::max();
  std::stop_token stop = {};  ///< cooperative cancellation
};

/// Result of near_triangles() and near_own_triangles().
struct NearTriangleList {
  std::vector<NearTriangles> pairs;  ///< in ascending order of a, then b
  bool is_complete = true;           ///< false: a limit ended the search, pairs are missing
};

/// Returns every pair of triangles of two meshes at most max_distance apart; with 0 every pair that
/// touches or crosses. A pair is left out only if it is proven farther apart; the few that are
/// listed but farther, by rounding, have an upper bound above max_distance.
/// @throws InvalidArgument unless max_distance is finite and >= 0.
NearTriangleList near_triangles(const TriangleMesh& a, const RigidPose& X_WA, const TriangleMesh& b,
                                const RigidPose& X_WB, Scalar max_distance,
                                const TrianglePairLimits& limits = {});

/// The same for a mesh against itself: pairs a < b of triangles that have no vertex number in
/// common. So a mesh whose triangles have vertices of their own meets itself along every edge:
/// merge them first.
NearTriangleList near_own_triangles(const TriangleMesh& mesh, Scalar max_distance,
                                    const TrianglePairLimits& limits = {});

}  // namespace dyop
