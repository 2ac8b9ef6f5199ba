// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "dyop/contact/contact_point.h"

namespace dyop::contact_internal {

/// In World, facets whose ridges rise above the smooth curve through them by at most so many
/// rest offsets act as that curve. Larger: bodies settle by that much when they stop; smaller: the
/// levers of forces on coarser facets err by half a facet.
inline constexpr Scalar kContactFitRestOffsets = 0.1;

/// The contact of the smooth curve that a row of contacts stands for, such as those of the corners
/// of a finely faceted rim: where the parabola through the nearest contact and its neighbours on
/// both sides comes nearest. Its points and normal are combinations of theirs, fixed in the bodies
/// like theirs; the rest is that of the nearest one. A corner is up to half a facet ahead of that
/// place or behind it, at random from step to step, and so is the lever of the force that acts there.
///
/// None where the contacts near the nearest one are not in a row, or of different kinds, or where
/// the parabola dips below its chords by more than `most_sagitta`, a length: such corners count.
/// @param near  Contacts of one pair, may hold `nearest`.
DYOP_EXPORT std::optional<ContactPoint> fitted_contact(const ContactPoint& nearest,
                                                       std::span<const ContactPoint* const> near,
                                                       Scalar most_sagitta);

}  // namespace dyop::contact_internal
