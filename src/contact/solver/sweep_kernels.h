// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"

// Sweeps over contacts, several at once. Plain numbers, for the wide kernels.
namespace dyop::contact_internal {

inline constexpr int kSweepWidth = 4;

/// Rounding of a residual, relative to the impulse times its mobility. Without it a huge impulse
/// would pass for a solution: what is missing vanishes beside it. Where targets contradict each
/// other, such impulses are all that solvers find.
inline constexpr double kResidualNoise = 0x1p-51;  // literal: 4 units of rounding

/// Contacts no two of which share a body that can be moved: Block and LocalContact of each, one
/// lane apiece. Bodies are offsets into the velocities; lanes without a contact, and bodies that
/// cannot be moved, have zeros and the offset of six numbers that nobody reads.
struct alignas(64) SweepGroup {
  double G_a[18][kSweepWidth];  ///< row by row
  double G_b[18][kSweepWidth];
  double free[3][kSweepWidth];
  double lambda[3][kSweepWidth];
  double W[6][kSweepWidth];  ///< lower triangle, row by row
  double friction[kSweepWidth];
  double weight[kSweepWidth];
  double normal_inverse[kSweepWidth];
  double tangential[kSweepWidth];
  double tangential_inverse[kSweepWidth];
  double is_coupled[kSweepWidth];  ///< 1 or 0
  double noise[kSweepWidth];       ///< added to the mobility along tangents
  double slip[kSweepWidth];        ///< of the last solution
  double before[3][kSweepWidth];   ///< lambda before the sweep
  double step[3][kSweepWidth];     ///< of the conjugate directions
  int body_a[kSweepWidth];
  int body_b[kSweepWidth];
  bool has_coupled;  ///< in any lane
};

struct SweepKernels {
  /// Solves every contact with all others fixed, from the first group to the last and back, and
  /// changes the velocities alike; keeps `before`. Returns the largest change of a velocity.
  double (*sweep)(SweepGroup* groups, int count, double* velocities);
  /// ContactSystem::residual(), rounding included. NaN if one of them is.
  double (*residual)(const SweepGroup* groups, int count, const double* velocities);
};

/// The kernels for an instruction set, which this processor must support: all give the same bits.
const SweepKernels& sweep_kernels(InstructionSet set);

}  // namespace dyop::contact_internal
