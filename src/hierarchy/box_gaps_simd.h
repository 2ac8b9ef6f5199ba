// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_axis.h"
#include "hierarchy/box_gaps.h"

// The kernel of box_gaps.h for the instruction set that this file is compiled for.
namespace dyop::hierarchy_internal {
inline namespace DYOP_LANES {

template <typename L>
DYOP_INLINE L slab_gap(const BoxLanes<L>& box, const FacingBox& other, const L* n) {
  // From the group's box to the other's: centers, minus both extents along n.
  L d[3];
  for (int i = 0; i < 3; ++i) d[i] = L(other.center[i]) - box.center[i];
  L reach(0.0);
  for (int k = 0; k < 3; ++k) {
    reach = reach + magnitude(dot(box.axes[k], n)) * box.half_extents[k];
    reach = reach + magnitude(dot(Broadcast3<L>(other.axes[k]).v, n)) * L(other.half_extents[k]);
  }
  return dot(d, n) - reach;
}

static void box_gaps_lanes(const GroupRows& rows, int count, const FacingBox& other, double noise,
                           double* gaps) {
  const RankingBox ranking(other, rows);
  float axes[3][kGroupWidth];
  find_axes(rows, count, ranking, axes);
  double result[kGroupWidth];
  for (int first = 0; first < count; first += Lanes::kCount) {
    const BoxLanes<Lanes> box(rows, first);
    Lanes n[3];
    unit_axis(axes, first, n);
    const Lanes gap = slab_gap(box, other, n);
    // |n| may exceed one by 32u. literal: twice that.
    ((gap - magnitude(gap) * Lanes(0x1p-47)) - Lanes(noise)).store(result + first);
  }
  for (int k = 0; k < count; ++k) gaps[k] = result[k];
}

}  // namespace DYOP_LANES

extern const BoxGapsKernel DYOP_KERNEL(box_gaps);
const BoxGapsKernel DYOP_KERNEL(box_gaps) = box_gaps_lanes;

}  // namespace dyop::hierarchy_internal
