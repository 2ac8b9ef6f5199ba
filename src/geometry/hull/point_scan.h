// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"

namespace dyop::geometry_internal {

/// Eight points, as plain numbers for the wide kernels.
struct ScanBlock {
  static constexpr int kPoints = 8;

  double x[kPoints];
  double y[kPoints];
  double z[kPoints];
};

/// The most blocks that a kernel takes at once.
inline constexpr int kScanBlocks = 16;

struct ScanKernels {
  /// The first of the points with the largest computed direction . p, and that; 0 if it is NaN.
  int (*farthest)(const ScanBlock* blocks, int count, const double* direction, double* largest);
  /// The largest computed direction . p.
  double (*largest)(const ScanBlock* blocks, int count, const double* direction);
};

/// The kernels for an instruction set, which this processor must support. All give the same bits.
ScanKernels scan_kernels(core_internal::InstructionSet set);

}  // namespace dyop::geometry_internal
