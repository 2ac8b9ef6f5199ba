// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

#include "dyop/core/types.h"

namespace dyop::dynamics_internal {

/// Adds the time it lives, in seconds, to a sum, unless it is off: then it reads no clock.
class PartTimer {
 public:
  PartTimer(bool is_on, Scalar& sum) : sum_(is_on ? &sum : nullptr) {
    if (sum_) begin_ = Clock::now();
  }
  ~PartTimer() {
    if (sum_) *sum_ += std::chrono::duration<Scalar>(Clock::now() - begin_).count();
  }
  PartTimer(const PartTimer&) = delete;
  PartTimer& operator=(const PartTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  Scalar* sum_;
  Clock::time_point begin_;
};

}  // namespace dyop::dynamics_internal
