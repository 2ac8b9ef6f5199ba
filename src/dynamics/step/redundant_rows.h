// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "dyop/contact/contact_problem.h"
#include "dyop/core/export.h"
#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// A row of a joint that holds a coordinate at zero.
struct HeldRow {
  std::size_t joint = 0;  ///< rows of one joint follow each other
  const JointRow* row = nullptr;
  Scalar value = 0;   ///< of the coordinate, length
  Scalar radius = 0;  ///< of the smaller body
};

/// Joints that close a loop hold some coordinates twice: a door on two hinges is held by ten rows
/// where five are enough. As long as the joints fit together that does no harm. If the second hinge
/// is off the axis of the first by a rounded decimal, no motion closes both, and the rows together
/// hold the door, or drive it at any speed.
///
/// Finds the rows of such loops that the rows before them imply, up to a few misfits, if what they
/// ask for contradicts those: they are to be left out, and stay open by their misfit. Loops that fit
/// together keep all their rows.
/// @param bodies Those from `movable` on cannot be moved.
/// @return Numbers of rows, ascending. Loops of more than 400 rows are not looked at.
DYOP_EXPORT std::vector<std::size_t> find_contradicting_rows(std::span<const HeldRow> rows,
                                                             std::span<const ContactBody> bodies,
                                                             std::size_t movable);

}  // namespace dyop::dynamics_internal
