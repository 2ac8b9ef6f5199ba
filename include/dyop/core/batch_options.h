// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Asked between the small pieces of a longer computation whether to stop: by a deadline, for
/// instance. Once it has said yes, it goes on saying so.
class Interrupt {
 public:
  virtual bool is_over() = 0;

 protected:
  ~Interrupt() = default;
};

/// False if there is none.
inline bool is_over(Interrupt* interrupt) {
  return interrupt && interrupt->is_over();
}

/// How a batch of queries is run. Nothing here changes the result of a query that is answered.
struct BatchOptions {
  /// Threads to use, including the caller's; 0, or more than there are cores: one per core.
  int thread_count = 0;
  /// Cooperative cancellation: no further query is started, and running ones stop as soon as they
  /// can.
  std::stop_token stop = {};
  /// Called after each query with the number of queries done and the total number. Calls never
  /// overlap and `done` rises by one from call to call, but they come from any of the threads. An
  /// exception thrown here ends the batch and reaches the caller.
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

}  // namespace dyop
