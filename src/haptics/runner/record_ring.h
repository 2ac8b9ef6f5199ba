// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "dyop/haptics/haptic_runner.h"

namespace dyop::haptics_internal {

/// Hands ticks from one thread to another without waiting and, once its slots have grown, without
/// allocating.
class RecordRing {
 public:
  explicit RecordRing(std::size_t size) : places_(size) {}

  /// For the writer: a slot to fill and then push(), or null if all slots wait to be read.
  TickRecord* free_place() {
    const std::size_t next = given_.load(std::memory_order_relaxed);
    if (next - taken_.load(std::memory_order_acquire) >= places_.size()) return nullptr;
    return &places_[next % places_.size()];
  }
  void push() {
    given_.store(given_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// For the reader: the oldest tick, to be read before pop(), or null.
  const TickRecord* front() const {
    const std::size_t next = taken_.load(std::memory_order_relaxed);
    if (next == given_.load(std::memory_order_acquire)) return nullptr;
    return &places_[next % places_.size()];
  }
  void pop() {
    taken_.store(taken_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

 private:
  std::vector<TickRecord> places_;
  std::atomic<std::size_t> given_{0};
  std::atomic<std::size_t> taken_{0};
};

}  // namespace dyop::haptics_internal
