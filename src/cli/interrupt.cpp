// SPDX-License-Identifier: BSD-3-Clause
#include "cli/interrupt.h"

#include <csignal>
#include <ctime>

namespace dyop::cli {
namespace {

sigset_t watched_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) {
    // A shell starts background jobs with SIGINT ignored; keep it so.
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&signals, signal);
  }
  return signals;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals](const std::stop_token& finished) {
    constexpr timespec kPatience{0, 50'000'000};  // longest wait of the destructor
    while (!finished.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &kPatience) < 0) continue;
      interrupted_.request_stop();
      pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // the next signal has its default effect
    }
  });
}

InterruptGuard::~InterruptGuard() {
  waiter_.request_stop();
  waiter_.join();
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

}  // namespace dyop::cli
