// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/box_steps_simd.h"

namespace dyop::toi_internal {

extern const BoxStepsKernels box_steps_avx2;
const BoxStepsKernels box_steps_avx2{box_steps_group, box_steps_one};

}  // namespace dyop::toi_internal
