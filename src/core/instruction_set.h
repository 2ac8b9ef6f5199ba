// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"

namespace dyop::core_internal {

/// Instruction sets that the wide kernels are built for. All give the same bits.
enum class InstructionSet { Baseline, Avx2, Avx512 };

/// The widest one that this processor supports and this build contains.
DYOP_EXPORT InstructionSet best_instruction_set();

}  // namespace dyop::core_internal
