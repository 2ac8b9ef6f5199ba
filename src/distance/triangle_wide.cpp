#include "distance/triangle_wide.h"

namespace dyop::internal {

extern const TriangleWideKernels triangle_wide_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const TriangleWideKernels triangle_wide_avx2;
extern const TriangleWideKernels triangle_wide_avx512;
#endif

const TriangleWideKernels& triangle_wide_kernels(InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == InstructionSet::Avx512) return triangle_wide_avx512;
  if (set == InstructionSet::Avx2) return triangle_wide_avx2;
#endif
  (void)set;
  return triangle_wide_baseline;
}

}  // namespace dyop::internal
