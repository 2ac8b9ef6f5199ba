// SPDX-License-Identifier: BSD-3-Clause
#include "distance/triangle_wide/triangle_wide.h"

#include "core/tolerance.h"
#include "distance/triangle_wide/triangle_block_access.h"

namespace dyop::distance_internal {

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

// These limits are built into the thorough kernel.
static_assert(kTriangleWalkLimit == 3 && kTrianglePiercingSteps == 2);

const TriangleConstants& triangle_constants() {
  static constexpr TriangleConstants kConstants{
      kTriangleRelativeSlack, kTriangleSizeSlack,   kTriangleNoise,
      kSmallestTriangleSize,  kLargestTriangleSize, kSmallestSquaredDirection,
      kSmallestFacetSquare,   kLargestFacetSquare,  kTriangleParallelSquare,
      kTriangleFlatSquare,    kTriangleContactGap,  kTriangleFarRatio};
  return kConstants;
}

}  // namespace dyop::distance_internal
