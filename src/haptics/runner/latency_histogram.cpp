// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/latency_histogram.h"

#include <algorithm>
#include <cmath>

#include "dyop/core/error.h"

namespace dyop {

void LatencyHistogram::add(std::chrono::nanoseconds latency) {
  const double doublings = std::log2(std::max(1.0, double(latency.count())));
  const auto bin = std::size_t(doublings * kBinsPerDoubling);
  ++bins_[std::min(bin, bins_.size() - 1)];
  ++count_;
  worst_ = std::max(worst_, latency);
}

std::chrono::nanoseconds LatencyHistogram::quantile(double part) const {
  DYOP_REQUIRE(part >= 0 && part <= 1, "LatencyHistogram: the part must be in [0, 1], not ", part);
  const double wanted = part * double(count_);
  std::int64_t sum = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    sum += bins_[bin];
    if (sum == 0 || double(sum) < wanted) continue;
    const double upper = std::exp2(double(bin + 1) / kBinsPerDoubling);
    return std::min(worst_, std::chrono::nanoseconds(std::int64_t(upper)));
  }
  return worst_;
}

}  // namespace dyop
