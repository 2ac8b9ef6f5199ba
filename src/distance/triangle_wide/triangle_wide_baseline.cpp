// SPDX-License-Identifier: BSD-3-Clause
#include "distance/triangle_wide/triangle_simd.h"

namespace dyop::distance_internal {

extern const TriangleWideKernels triangle_wide_baseline;
const TriangleWideKernels triangle_wide_baseline = {decide_triangles<false>, decide_triangles<true>,
                                                    triangles_within};

}  // namespace dyop::distance_internal
