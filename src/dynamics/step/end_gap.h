// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dynamics/body_record.h"
#include "dynamics/pair_state.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/toi/toi_result.h"

namespace dyop::internal {

/// The gap of a contact after both bodies have moved from its poses X_WA, X_WB to new ones: between
/// the same features, where a face moves with its body and a rounded core is taken at its centre.
Scalar end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end);

/// How far a gap may close at the rate of its start without taking more than `room` meanwhile. A
/// corner of a fast turning body comes down and is up again at the end of the leg: over it, s from 0
/// to 1, the gap is g - c s + e s^2 with the closing c and the error e > 0 of the linear prediction.
/// Its least value, g - c^2 / (4 e), must not fall short by more than the room. Infinite for e <= 0,
/// where the end is nearest.
Scalar closing_at_dip(Scalar room, Scalar error);

/// Whether the surfaces may bring another facet than the contact's to it within a short way: a
/// contact that stands for its neighbours, or that of a ball on a mesh.
bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b);

/// What is expected of such a contact.
struct CurvedMove {
  Scalar end_gap;  ///< as predicted
  Scalar way;      ///< that the contact moves over the surfaces
};

/// The least gap near such a contact at new poses, measured afresh; none if it hardly moves or if
/// nothing is found there. The new poses may overlap, as far as a flat facet reaches into a surface.
std::optional<Scalar> measured_end_gap(const ContactPoint& point, const CurvedMove& move,
                                       const PairLengths& lengths, const BodyRecord& a,
                                       const RigidPose& X_WA_end, const BodyRecord& b,
                                       const RigidPose& X_WB_end, ContactWorkspace& workspace);

/// The contact of a hit, moved back with its bodies to earlier poses: the normal moves with its
/// face.
ContactPoint point_of_hit(const ToiResult& hit, const RigidPose& X_WA, const RigidPose& X_WB);

}  // namespace dyop::internal
