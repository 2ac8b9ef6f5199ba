// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/export.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

class IslandRun;

/// A contact's demand on a small motion of a body, which shifts its point p by v + w x p:
/// n . (v + w x p) >= missing.
struct GapDemand {
  Vector3 nhat_W = Vector3::UnitX();
  Vector3 p_W = Vector3::Zero();
  Scalar missing = 0;
};

/// Whether some small motion of one body meets all demands. A motion longer than about a thousand
/// times the largest demand is not small: a plug with so little taper counts as stuck.
DYOP_EXPORT bool can_meet(std::span<const GapDemand> demands);

/// Chooses the rest offset of each pair of the island that is in contact. It is the usual one unless
/// a body has too little room within another body, or between the static bodies around it, like a pin
/// in a close hole or a drawer in its slot. Contacts on both sides would then ask for rest gaps that
/// contradict each other, and hold the body still. There the rest offset is halved until it is at
/// most half of the room beyond the target distance.
void fit_rest_offsets(IslandRun& run);

}  // namespace dyop::dynamics_internal
