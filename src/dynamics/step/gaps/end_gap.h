// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_point.h"
#include "dyop/toi/toi_result.h"

namespace dyop::dynamics_internal {

/// A contact at the end of a substep.
struct EndGap {
  Scalar gap = 0;
  /// Where it is by then, in world; none where that is not known.
  std::optional<Vector3> p_W = {};
  bool is_smooth = false;  ///< that of a smooth curve, which no facet disturbs
};

bool is_edge_pair(const ContactPoint& point);

/// The gap of a contact after both bodies have moved from its poses X_WA, X_WB to new ones: between
/// the same features, where a face moves with its body and a rounded core is taken at its centre.
/// Rounded points and edges against each other: the exact distance of these features.
EndGap end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end);

/// How far a gap may close at the rate of its start without taking more than `room` meanwhile. A
/// corner of a fast turning body comes down and is up again at the end of the substep: over it, s from 0
/// to 1, the gap is g - c s + e s^2 with the closing c and the error e > 0 of the linear prediction.
/// Its least value, g - c^2 / (4 e), must not fall short by more than the room. Infinite where e <=
/// room: with c <= 2 e the dip is at most e, and with a larger c the end is nearest.
Scalar closing_at_dip(Scalar room, Scalar error);

/// The contact of a hit, moved back with its bodies to earlier poses: the normal moves with its
/// face.
ContactPoint point_of_hit(const ToiResult& hit, const RigidPose& X_WA, const RigidPose& X_WB);

}  // namespace dyop::dynamics_internal
