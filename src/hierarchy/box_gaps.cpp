// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_gaps.h"

namespace dyop::hierarchy_internal {

extern const BoxGapsKernel box_gaps_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const BoxGapsKernel box_gaps_avx2;
extern const BoxGapsKernel box_gaps_avx512;
#endif

BoxGapsKernel box_gaps_kernel(InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == InstructionSet::Avx512) return box_gaps_avx512;
  if (set == InstructionSet::Avx2) return box_gaps_avx2;
#endif
  (void)set;
  return box_gaps_baseline;
}

}  // namespace dyop::hierarchy_internal
