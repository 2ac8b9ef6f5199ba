// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>

#include "dyop/core/types.h"

namespace dyop::core_internal {

/// So many seconds from now. A year is as good as no limit, and can be added to the clock.
inline std::chrono::steady_clock::time_point deadline_after(Scalar seconds) {
  using Clock = std::chrono::steady_clock;
  constexpr Scalar kLongest = 365 * 24 * 3600;
  const std::chrono::duration<Scalar> limit(std::min(seconds, kLongest));
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
}

}  // namespace dyop::core_internal
