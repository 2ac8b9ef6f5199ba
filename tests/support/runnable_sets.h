// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/instruction_set.h"

namespace dyop::testing {

/// The instruction sets that this processor and this build can run.
inline std::vector<core_internal::InstructionSet> runnable_sets() {
  using core_internal::InstructionSet;
  std::vector<InstructionSet> sets{InstructionSet::Baseline};
  const InstructionSet best = core_internal::best_instruction_set();
  if (best != InstructionSet::Baseline) sets.push_back(InstructionSet::Avx2);
  if (best == InstructionSet::Avx512) sets.push_back(InstructionSet::Avx512);
  return sets;
}

}  // namespace dyop::testing
