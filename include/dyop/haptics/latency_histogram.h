// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Counts durations from a nanosecond to minutes in bins of an eighth of a doubling: 9 % wide at
/// most. Fixed memory.
class LatencyHistogram {
 public:
  void add(std::chrono::nanoseconds latency);

  std::int64_t count() const { return count_; }
  std::chrono::nanoseconds worst() const { return worst_; }
  /// A duration that at least this part of all did not exceed, to the width of a bin; zero if there
  /// are none.
  /// @throws InvalidArgument unless 0 <= part <= 1.
  std::chrono::nanoseconds quantile(double part) const;

 private:
  static constexpr int kBinsPerDoubling = 8;
  static constexpr int kDoublings = 40;

  std::array<std::int64_t, kDoublings * kBinsPerDoubling> bins_{};
  std::int64_t count_ = 0;
  std::chrono::nanoseconds worst_{0};
};

}  // namespace dyop
