// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_gaps_simd.h"

namespace dyop::hierarchy_internal {

extern const BoxGapsKernel box_gaps_baseline;
const BoxGapsKernel box_gaps_baseline = box_gaps_lanes;

}  // namespace dyop::hierarchy_internal
