// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "contact/generation/flat_contacts.h"
#include "dynamics/body_record.h"
#include "dynamics/pair_state.h"
#include "dynamics/step/ledger.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"
#include "dyop/contact/contact_problem.h"
#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/toi/toi_result.h"

namespace dyop::dynamics_internal {

/// A contact at the end of a substep.
struct EndGap {
  Scalar gap = 0;
  /// Where it is by then, in world; none where that is not known.
  std::optional<Vector3> p_W = {};
  bool is_smooth = false;  ///< that of a smooth curve, which no facet disturbs
  /// Of two edges that are nearly parallel, or lie on faces: they may have slid past each other.
  bool may_overstate = false;
  bool passes = false;  ///< of two corners that pass each other: the least gap on the way
  /// Of rounded corners: the least gap on the way.
  std::optional<Scalar> least = {};
};

/// Whether one side of a contact is a face, whose normal it has.
bool is_on_face(const ContactPoint& point);

/// The gap of a contact after both bodies have moved from its poses X_WA, X_WB to new ones: between
/// the same features, where a face moves with its body and a rounded core is taken at its centre.
/// Rounded points and edges against each other: the exact distance of these features; edges that
/// cross: that of their lines; sharp corners that pass each other: see passing_gap().
EndGap end_gap(const ContactPoint& point, const BodyRecord& a, const RigidPose& X_WA,
               const RigidPose& X_WA_end, const BodyRecord& b, const RigidPose& X_WB,
               const RigidPose& X_WB_end);

/// How far a gap may close at the rate of its start without taking more than `room` meanwhile. A
/// corner of a fast turning body comes down and is up again at the end of the substep: over it, s
/// from 0 to 1, the gap is g - c s + e s^2 with the closing c and the error e > 0 of the linear
/// prediction. Its least value, g - c^2 / (4 e), must not fall short by more than the room.
/// Infinite where e <= room: with c <= 2 e the dip is at most e, and with a larger c the end is
/// nearest.
Scalar closing_at_dip(Scalar room, Scalar error);

/// How near two corners, vertices or edges, come to each other while they pass: the leading edge of
/// a box that slides over the seam between two tiles of a floor, and the next tile's edge. Their
/// normal is the line between them, which turns with their motion; its first direction would have
/// the box stop before the seam.
///
/// The gap is that of the two features while the line between them leaves both shapes, and that of
/// the faces beside them after that.
/// @return The least gap on the straight way from the poses at the start to those at the end; none
///         if the line turns by less than 15 degrees, if the corners meet, or if the contact is not
///         of two corners.
DYOP_EXPORT std::optional<Scalar> passing_gap(const ContactPoint& point,
                                              const contact_internal::MovedPieces& pieces);

/// The least distance of the two features of a contact of corners, rounded or not, on the straight
/// way from the poses at the start to those at the end: where a ball comes over an edge onto a face,
/// its gap is no parabola. None if the contact is not of two corners, or if neither has faces, as
/// of two balls.
DYOP_EXPORT std::optional<Scalar> least_corner_gap(const ContactPoint& point,
                                                   const contact_internal::MovedPieces& pieces);

/// Two bodies at the poses from which a move was hit.
struct HitPair {
  const BodyRecord& a;
  RigidPose X_WA;
  const BodyRecord& b;
  RigidPose X_WB;
};

/// The contacts of a hit, moved back with its bodies: normals move with their faces, points on
/// rounded cores with the cores, those on smooth bodies with the centres of mass. Of two convex
/// shapes those that are nearer than `reach` at the hit and face the same way as it: a cylinder meets
/// an edge along a line, and would be turned by a push at one place of it.
std::vector<ContactPoint> contacts_of_hit(const ToiResult& hit, const HitPair& pair, Scalar reach,
                                          ContactWorkspace& workspace);

/// Where the impulse of such a contact acts on both bodies at the earlier poses, at which its two
/// points are not yet opposite each other: in the middle of the gap, and opposite the point that
/// slides over the other body's face, or the vertex. A ball would else be turned by a push along its
/// normal, and a needle about its axis.
Vector3 acting_point(const ContactPoint& hit, const ContactBody& body_a, const ContactBody& body_b);

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
