// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/export.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

class IslandRun;

/// What a contact asks of a body that moves a little, by v + w x p at p: n . (v + w x p) >= missing.
struct GapDemand {
  Vector3 nhat_W = Vector3::UnitX();
  Vector3 p_W = Vector3::Zero();
  Scalar missing = 0;
};

/// Whether some small motion of one body meets all demands. A motion a thousand times as long as
/// the largest demand is not small: a plug of so little taper does not come free by it.
DYOP_EXPORT bool can_meet(std::span<const GapDemand> demands);

/// Chooses the rest offsets of the pairs of an island that have contacts at now. They are the usual
/// ones, unless a body that is surrounded by another one, or by static bodies, has too little room:
/// a pin in a close hole, a drawer in its slot. Contacts on both sides would then ask for rest gaps
/// that contradict each other, and hold the body still. There the rest offset is halved until it is
/// no more than half of the room that is left beyond the target distance.
void fit_rest_offsets(IslandRun& run);

}  // namespace dyop::dynamics_internal
