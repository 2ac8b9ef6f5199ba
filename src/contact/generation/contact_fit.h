// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::contact_internal {

/// In World, facets whose ridges rise above the smooth curve through them by at most so many
/// rest offsets act as that curve. Larger: bodies settle by that much when they stop; smaller: the
/// levers of forces on coarser facets err by half a facet.
inline constexpr Scalar kContactFitRestOffsets = 0.1;

/// The contact of the smooth curve that a row of contacts stands for, such as those of the corners
/// of a finely faceted rim: where the parabola through the nearest contact and its neighbours on
/// both sides comes nearest. Its points and normal are combinations of theirs, fixed in the bodies
/// like theirs; the rest is that of the nearest one. A corner is up to half a facet ahead of that
/// place or behind it, at random from step to step, and so is the lever of the force that acts
/// there.
///
/// None where the contacts near the nearest one are not in a row, or of different kinds, or where
/// the parabola dips below its chords by more than `most_sagitta`, a length: such corners count.
/// @param near  Contacts of one pair, may hold `nearest`.
DYOP_EXPORT std::optional<ContactPoint> fitted_contact(const ContactPoint& nearest,
                                                       std::span<const ContactPoint* const> near,
                                                       Scalar most_sagitta);

/// Contacts of a ball, or of a rounded corner, on a finely faceted mesh: moves them to where the
/// smooth surface comes nearest whose normals at the mesh's vertices are those of a sphere through
/// the neighbours ([Max1999]), in between linear. A facet's own normal is off by up to half the
/// angle to the next one, at random from step to step as the ball rolls.
///
/// Left alone: contacts on facets that leave that surface by more than `most_sagitta`, a length, at
/// a border, or with a vertex whose triangles turn too much. 0: all are. Returns whether any moved.
DYOP_EXPORT bool fit_ball_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                   const RigidPose& X_WB, Scalar most_sagitta,
                                   std::vector<ContactPoint>& contacts);

}  // namespace dyop::contact_internal
