// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
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

/// Ticks that the log may be behind: two seconds at 1 kHz.
inline constexpr std::size_t kWaitingTicks = 2048;

/// How often the threads beside the loop look for work.
inline constexpr std::chrono::microseconds kIdle{500};

/// Writes a tick of all tools into a record, which keeps its memory.
inline void put_record(std::int64_t number, std::span<const DevicePose> devices, Scalar dt,
                       std::span<const HapticTick> ticks, TickRecord& record) {
  record.number = number;
  record.dt = dt;
  record.device = devices[0];
  record.tick = ticks[0];
  record.others.resize(devices.size() - 1);
  for (std::size_t k = 0; k < record.others.size(); ++k) {
    record.others[k].device = devices[k + 1];
    record.others[k].tick = ticks[k + 1];
  }
}

}  // namespace dyop::haptics_internal
