// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/toi/vertex_time_of_impact.h"

namespace dyop::toi_internal {

// Whether the two elements have a point in common at some instant of the interval, its ends
// included. Exact for all finite coordinates, in integer arithmetic, including coplanar, parallel,
// degenerate and resting elements. docs/algorithms/linear_vertex_motion.md, "Exact contact".
bool has_contact(const VertexFacePaths& paths);
bool has_contact(const EdgeEdgePaths& paths);

}  // namespace dyop::toi_internal
