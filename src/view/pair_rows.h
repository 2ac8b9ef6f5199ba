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

/// The mark of an advance that did not reach its end, or null.
const char* undecided_words(AdvanceStatus status);

}  // namespace dyop::view_internal
