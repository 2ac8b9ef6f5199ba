// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/box_steps.h"

namespace dyop::toi_internal {

extern const BoxStepsKernels box_steps_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const BoxStepsKernels box_steps_avx2;
extern const BoxStepsKernels box_steps_avx512;
#endif

BoxStepsKernels box_steps_kernels(InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == InstructionSet::Avx512) return box_steps_avx512;
  if (set == InstructionSet::Avx2) return box_steps_avx2;
#endif
  (void)set;
  return box_steps_baseline;
}

}  // namespace dyop::toi_internal
