// SPDX-License-Identifier: BSD-3-Clause
#include "core/instruction_set.h"

namespace dyop::core_internal {

InstructionSet best_instruction_set() {
#ifdef DYOP_HAS_X86_KERNELS
  static const InstructionSet best = [] {
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
      return InstructionSet::Avx512;
    }
    return __builtin_cpu_supports("avx2") ? InstructionSet::Avx2 : InstructionSet::Baseline;
  }();
  return best;
#else
  return InstructionSet::Baseline;
#endif
}

}  // namespace dyop::core_internal
