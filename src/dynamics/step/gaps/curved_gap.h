// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dynamics/pair_state.h"
#include "dynamics/step/gaps/end_gap.h"
#include "dyop/contact/contact_generator.h"

namespace dyop::internal {

/// Whether the surfaces may bring another facet than the contact's to it within a short way: a
/// contact that stands for its neighbours, or that of a ball on a mesh.
bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b);

/// What is expected of such a contact.
struct CurvedMove {
  Scalar end_gap = 0;  ///< as predicted
  Scalar sliding = 0;  ///< of the bodies' points at the contact, a length
  Scalar turn = 0;     ///< of the bodies to each other, rad
  Scalar rolling = 0;  ///< the part of it that is not about the normal: it moves the contact, rad
  /// Where the pair's other contacts are at the end. What is found nearer to one of them belongs to
  /// it.
  std::vector<Vector3> others_W = {};
};

/// The least gap near such a contact at new poses, measured afresh; none if it hardly moves or if
/// nothing is found there. The new poses may overlap, as far as a flat facet reaches into a surface.
std::optional<EndGap> measured_end_gap(const ContactPoint& point, const CurvedMove& move,
                                       const PairState& pair, const BodyRecord& a,
                                       const RigidPose& X_WA_end, const BodyRecord& b,
                                       const RigidPose& X_WB_end, ContactWorkspace& workspace);

}  // namespace dyop::internal
