#pragma once

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/deforming_mesh.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

/// Returns when two deforming meshes first come within target_distance, or proves that they do not.
///
/// Statuses, guarantee and options are those of time_of_impact() of rigid shapes; X_WA and X_WB of
/// the result stay the identity, as vertices are given in world, and features name vertices of the
/// meshes. Best-first over pairs of nodes of swept boxes, then of triangles.
///
/// @param interval The vertices are at begin() at its begin, at end() at its end. Finite, not
///                 reversed; of an interval of length zero only begin() counts.
/// @throws InvalidArgument if an option is out of range or the interval is not valid.
/// Const, thread-safe, deterministic unless a deadline or stop ends it.
/// See docs/algorithms/linear_vertex_motion.md.
ToiResult time_of_impact(const DeformingMesh& a, const DeformingMesh& b,
                         const TimeInterval& interval, const ToiOptions& options = {});

/// The same for a deforming mesh A and a rigid mesh B on any motion, which must be defined on all
/// of `interval`; X_WB of the result is its pose at t_safe.
ToiResult time_of_impact(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options = {});

}  // namespace dyop
