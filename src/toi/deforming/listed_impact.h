// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "distance/distance_traversal.h"
#include "dyop/core/export.h"
#include "dyop/toi/deforming_time_of_impact.h"

namespace dyop::toi_internal {

/// As time_of_impact() of a part of a deforming mesh's interval, but of the given pairs of nodes or
/// triangles only: what is proven holds if all others are proven apart otherwise.
/// @param pairs Nodes of A, boxes of B's hierarchy; their gaps are not used. Must outlive the call.
DYOP_EXPORT ToiResult time_of_listed_impact(const DeformingMesh& a, const DeformingSpan& span,
                                            const TriangleMesh& b, const Motion& X_WB,
                                            const TimeInterval& interval, const ToiOptions& options,
                                            ToiWorkspace& workspace,
                                            std::span<const BoxPair> pairs);

}  // namespace dyop::toi_internal
