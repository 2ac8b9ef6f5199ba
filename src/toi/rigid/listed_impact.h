// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "distance/distance_traversal.h"
#include "dyop/core/export.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::toi_internal {

/// As time_of_impact(), but of the given pairs of boxes only: what is proven holds if all others
/// are proven apart otherwise.
/// @param pairs Boxes of the two shapes' trees; their gaps are not used. Must outlive the call.
DYOP_EXPORT ToiResult time_of_listed_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                            const Motion& X_WB, const TimeInterval& interval,
                                            const ToiOptions& options, ToiWorkspace& workspace,
                                            std::span<const BoxPair> pairs);

}  // namespace dyop::toi_internal
