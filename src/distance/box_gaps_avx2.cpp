#include "distance/box_gaps_lanes.h"

namespace dyop::internal {

extern const BoxGapsKernel box_gaps_avx2;
const BoxGapsKernel box_gaps_avx2 = box_gaps_lanes;

}  // namespace dyop::internal
