// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "dyop/core/export.h"
#include "hierarchy/facing_box.h"

namespace dyop::hierarchy_internal {

/// Lower bounds on the distances of the boxes of a group to one other box, eight at once: the slab
/// gap along the best of sixteen axes, rounded down ([Gottschalk1996] for the axes;
/// docs/algorithms/distance.md).
///
/// @param rows  The group, in the frame of its shape.
/// @param count Boxes in use; `gaps` gets this many numbers, negative or zero where no axis
/// separates.
/// @param other The other box, in the same frame.
/// @param noise Allowance for rounding in a gap, length.
using BoxGapsKernel = void (*)(const GroupRows& rows, int count, const FacingBox& other,
                               double noise, double* gaps);

/// The kernel for an instruction set, which this processor must support.
DYOP_EXPORT BoxGapsKernel box_gaps_kernel(InstructionSet set);

}  // namespace dyop::hierarchy_internal
