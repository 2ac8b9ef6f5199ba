// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stop_token>
#include <thread>

namespace dyop::cli {

/// While this object lives, the first SIGINT or SIGTERM requests a stop instead of ending the
/// process, so that partial results can be printed; the second one ends the process. Create it
/// before any thread.
///
/// A thread of its own waits for the signals: a signal handler may not call request_stop().
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  std::stop_token token() const { return interrupted_.get_token(); }

 private:
  std::stop_source interrupted_;
  std::jthread waiter_;
};

}  // namespace dyop::cli
