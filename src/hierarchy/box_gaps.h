// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "dyop/core/export.h"

namespace dyop::hierarchy_internal {

/// The rows of BoxGroup: center, three axes, half extents; one column per box. Centers, from an
/// origin, and half extents are multiples of a scale.
inline constexpr int kGroupWidth = 8;
inline constexpr int kGroupAxes = 3;
inline constexpr int kGroupHalfExtents = 12;
struct GroupRows {
  const float (*rows)[kGroupWidth];
  double scale;
  double origin[3];
};

/// One box in the frame of the shape that a group belongs to. Plain numbers, for the wide kernels.
struct FacingBox {
  double center[3];
  double axes[3][3];  ///< axes[k]: axis k, of about unit length
  double half_extents[3];
  /// Whether this box or those of the group are cores of rounded shapes. These may be long and thin
  /// and far apart for their size, so the direction between nearest points is tried too. Speed
  /// only.
  bool is_of_cores;
};

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
