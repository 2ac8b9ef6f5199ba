// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/distance/distance.h"
#include "dyop/dynamics/pair_record.h"
#include "dyop/view/page_encoder.h"

namespace dyop::view_internal {

/// Adds the gap and the contacts of a near pair at the end of a frame.
void add_pair(const PairRecord& pair, const TimeInterval& frame, PageSpan& span);

/// Computes witness points and tight bounds of a gap by one distance query.
void add_witness(PageGap& gap, const Shape& a, const RigidPose& X_WA, const Shape& b,
                 const RigidPose& X_WB, DistanceCache& cache);

/// Puts the witness points, normal and bounds of an impact where the shapes are at these poses, the
/// committed ones. Where a force acts, the poses of the impact's own query differ from them, and
/// its points would float beside the bodies. A pair that overlaps here keeps what it has.
void place_impact(ImpactEvent& event, const Shape& a, const RigidPose& X_WA, const Shape& b,
                  const RigidPose& X_WB);

/// The mark of an advance that did not reach its end, or null.
const char* undecided_words(AdvanceStatus status);

/// Why a run whose last advance had this status ended at time t, as a sentence.
const char* ending_words(AdvanceStatus status, Scalar t, Scalar planned_end);

}  // namespace dyop::view_internal
