// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/toi/deforming_mesh.h"

namespace DYOP_EXPORT dyop {

/// Returns the distance of a deforming mesh A, as it stands at the fraction s of its interval, from
/// a rigid mesh B, with proven bounds lower <= d <= upper and witness points in world; features and
/// triangles have the meshes' own numbers. Starts from the pieces that were nearest in the last
/// query with `cache`, and allocates nothing once that has grown.
///
/// @param s       Fraction of A's interval, 0 <= s <= 1.
/// @param options Only max_distance counts: both sides are surfaces, bounds are as close as
///                rounding lets them.
/// @throws InvalidArgument if s or max_distance is out of its range or NaN.
/// Const and thread-safe in the meshes.
DistanceResult distance(const DeformingMesh& a, Scalar s, const TriangleMesh& b,
                        const RigidPose& X_WB, const DistanceOptions& options,
                        DistanceCache& cache);

/// Finds pairs of triangles of the two meshes at most `max_distance` apart, with certified bounds
/// of their distance. Ends when `limit` pairs are found; nearest boxes are searched first. A
/// full list means the result is truncated.
/// @param pairs Replaced by the pairs, in the order they were found.
/// @throws InvalidArgument as distance(), and unless max_distance is finite.
void find_near_pairs(const DeformingMesh& a, Scalar s, const TriangleMesh& b, const RigidPose& X_WB,
                     Scalar max_distance, std::size_t limit, DistanceCache& cache,
                     std::vector<WitnessPair>& pairs);

}  // namespace dyop
