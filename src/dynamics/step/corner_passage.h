// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact/generation/flat_contacts.h"
#include "dyop/contact/contact_point.h"
#include "dyop/core/export.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// Cosine of 15 degrees: shapes whose normal turns farther in a substep pass each other. Bodies that
/// rest edge on edge turn it by less.
inline constexpr Scalar kPassingCosine = 0.966;

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

}  // namespace dyop::dynamics_internal
