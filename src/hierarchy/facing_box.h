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
  /// Whether this box or those of the group are cores of rounded shapes. These may be long and thin
  /// and far apart for their size, so the direction between nearest points is tried too. Speed
  /// only.
  bool is_of_cores;
};

}  // namespace dyop::hierarchy_internal
