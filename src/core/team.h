// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <type_traits>

#include "dyop/core/export.h"

namespace dyop::core_internal {

class Team;

/// Calls lead(team) once, while up to thread_count - 1 other threads help; zero: as many as there
/// are cores. Throws what `lead` throws.
DYOP_EXPORT void with_team(int thread_count, const std::function<void(Team&)>& lead);

/// Threads that share many loops, each too short to wake threads for: between loops the helpers
/// watch for the next one. A loop is cut into parts that whoever is free takes; the leader takes
/// them too and waits only for parts that a helper has begun, so that it gets on at its own pace
/// where helpers come late or not at all.
class DYOP_EXPORT Team {
 public:
  /// For run_workers(): leads or helps.
  void work(std::size_t worker);

  /// Whether there may be helpers.
  bool has_helpers() const { return threads_ > 1; }

  /// Calls part(begin, end) for consecutive parts of [0, count), some at the same time: a few for
  /// each thread, but none shorter than `least`, except the last. `part` must not throw. Returns
  /// when all are done. For the leader alone.
  template <typename Part>
  void run(std::size_t count, std::size_t least, Part&& part) {
    using Plain = std::remove_reference_t<Part>;
    run_loop([](const void* context, std::size_t begin,
                std::size_t end) { (*static_cast<const Plain*>(context))(begin, end); },
             &part, count, least);
  }

 private:
  friend void with_team(int thread_count, const std::function<void(Team&)>& lead);
  using Call = void (*)(const void* context, std::size_t begin, std::size_t end);

  struct Loop {
    Call call = nullptr;
    const void* context = nullptr;
    std::size_t count = 0;
    std::size_t portion = 1;
    std::size_t parts = 0;
  };

  void run_loop(Call call, const void* context, std::size_t count, std::size_t least);
  void take_parts(std::uint64_t number);
  void help();

  std::size_t threads_ = 1;
  const std::function<void(Team&)>* lead_ = nullptr;
  std::exception_ptr error_;  // that the leader threw
  std::atomic<bool> has_leader_{false};
  std::atomic<bool> has_ended_{false};
  std::atomic<std::size_t> left_{0};  // threads
  // The number of the loop in the upper half, and how many of its parts are left in the lower. Who
  // takes one off has that part, and may read loop_ until the part is done: the next loop is written
  // only when all are.
  std::atomic<std::uint64_t> next_{0};
  Loop loop_;
  std::atomic<std::size_t> done_{0};  // of the parts
};

}  // namespace dyop::core_internal
