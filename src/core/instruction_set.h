// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"

namespace dyop::internal {

/// Widths of arithmetic that the wide kernels are built for. All give the same bits.
enum class InstructionSet { Baseline, Avx2, Avx512 };

/// The widest that this processor and this build can run.
DYOP_EXPORT InstructionSet best_instruction_set();

}  // namespace dyop::internal
