// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dyop::hierarchy_internal {

/// The rows of BoxGroup: center, three axes, half extents; one column per box. Centers and half
/// extents are multiples of a scale.
inline constexpr int kGroupWidth = 8;
inline constexpr int kGroupAxes = 3;
inline constexpr int kGroupHalfExtents = 12;
struct GroupRows {
  const float (*rows)[kGroupWidth];
  double scale;
};

/// One box in the frame of the shape that a group belongs to. Plain numbers, for the wide kernels.
struct FacingBox {
  double center[3];
  double axes[3][3];  ///< axes[k]: axis k, of about unit length
  double half_extents[3];
};

}  // namespace dyop::hierarchy_internal
