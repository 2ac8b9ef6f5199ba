// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dynamics/pair_state.h"
#include "dynamics/step/certify.h"
#include "dynamics/step/gaps/end_gap.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/core/export.h"

namespace dyop::dynamics_internal {

/// Whether the surfaces may bring another facet than the contact's to it within a short way: a
/// contact that stands for its neighbours, or that of a ball on a mesh.
bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b);

/// What is expected of such a contact.
struct CurvedMove {
  Scalar end_gap = 0;  ///< as predicted
  Scalar sliding = 0;  ///< of the bodies' points at the contact, a length
  Scalar turn = 0;     ///< of the bodies to each other, rad
  Scalar rolling = 0;  ///< the part of it that is not about the normal: it moves the contact, rad
};

struct CurvedContact {
  const ContactPoint* point = nullptr;
  CurvedMove move;
};

/// A pair at new poses.
struct PairAtEnd {
  const PairLengths& lengths;
  const Shape& a;
  const RigidPose& X_WA;
  const Shape& b;
  const RigidPose& X_WB;
  /// Where all contacts of the pair are by then, on A. What is found belongs to the nearest.
  std::span<const Vector3> points_W;
};

/// The least gap near each of these contacts of a pair at new poses, measured afresh; none if it
/// hardly moves or if nothing is found there. The new poses may overlap, as far as a flat facet
/// reaches into a surface.
/// @param neighbours Of the pair; affects speed only.
/// @return Nothing at all if the deadline ended the search, or if the bodies move so far that most
///         of their triangles would have to be looked at: a shorter substep has less to look at.
DYOP_EXPORT std::optional<std::vector<std::optional<EndGap>>> measured_end_gaps(
    const PairAtEnd& pair, std::span<const CurvedContact> contacts, NeighbourList& neighbours,
    const QueryLimits& limits, ContactWorkspace& workspace);

}  // namespace dyop::dynamics_internal
