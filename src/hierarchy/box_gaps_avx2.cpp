// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_gaps_simd.h"

namespace dyop::hierarchy_internal {

extern const BoxGapsKernel box_gaps_avx2;
const BoxGapsKernel box_gaps_avx2 = box_gaps_lanes;

}  // namespace dyop::hierarchy_internal
