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

/// A joint that lets a body move only with j_v . v + j_w . w = 0, about the world's origin.
struct MotionHold {
  Vector3 j_v = Vector3::Zero();
  Vector3 j_w = Vector3::Zero();
};

/// Whether some small motion of one body that the joints allow meets all demands. A motion longer
/// than about a thousand times the largest demand is not small: a plug with so little taper counts
/// as stuck.
DYOP_EXPORT bool can_meet(std::span<const GapDemand> demands,
                          std::span<const MotionHold> holds = {});

/// Chooses the rest offset of each pair of the island that is in contact. It is the usual one unless
/// a body has too little room within another body, within bodies that joints connect, or between
/// those that it cannot move: a pin in a close hole, a drawer in its slot, a carriage on a rail close
/// above a floor. Contacts on both sides would then ask for rest gaps that contradict each other, and
/// hold the body still. There the rest offset is halved until it is at most half of the room beyond
/// the target distance.
void fit_rest_offsets(IslandRun& run);

}  // namespace dyop::dynamics_internal
