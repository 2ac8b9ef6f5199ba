// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/export.h"
#include "dyop/core/interrupt.h"
#include "dyop/distance/distance.h"

namespace dyop::distance_internal {

/// As distance(), unless it is interrupted, which is asked after every few pairs of boxes: then
/// nothing.
DYOP_EXPORT std::optional<DistanceResult> distance_until(const Shape& a, const RigidPose& X_WA,
                                                         const Shape& b, const RigidPose& X_WB,
                                                         const DistanceOptions& options,
                                                         DistanceCache& cache,
                                                         Interrupt& interrupt);

}  // namespace dyop::distance_internal
