// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/deforming_mesh.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

/// Returns when two deforming meshes first come within target_distance, or proves that they do not.
///
/// ToiStatus states what is promised. Options are those of time_of_impact() of rigid shapes, except
/// solid_a and solid_b. Features name vertices of the meshes. The search is the one for rigid
/// shapes, over pairs of nodes of swept boxes and then of triangles.
///
/// @param interval The vertices are at begin() at its start, at end() at its end. Finite, not
///                 reversed; if its length is zero only begin() counts.
/// @throws InvalidArgument if an option is out of range or the interval is not valid.
/// Reads the meshes only; thread-safe, deterministic unless a deadline or stop ends it.
/// See docs/algorithms/linear_vertex_motion.md.
ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options = {});

/// The same, in the memory of `workspace`; resume continues its last query as for rigid shapes
/// (time_of_impact.h), if the meshes were not refitted in between.
ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace);
ToiResult resume_time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                                const TimeInterval& interval, const ToiOptions& options,
                                ToiWorkspace& workspace);

/// The same for a deforming mesh A and a rigid mesh B on any motion, which must be defined on all
/// of `interval`.
ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options = {});
ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace);
ToiResult resume_time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                                const TimeInterval& interval, const ToiOptions& options,
                                ToiWorkspace& workspace);

/// The same while A goes through a part of its own interval only, as a tool does that is stepped
/// many times between two snapshots of an organ. Cannot be resumed.
/// @throws InvalidArgument as above, and unless 0 <= span.begin <= span.end <= 1.
ToiResult time_of_impact(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
                         const Motion& X_WB, const TimeInterval& interval,
                         const ToiOptions& options, ToiWorkspace& workspace);

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
