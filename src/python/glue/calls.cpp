// SPDX-License-Identifier: BSD-3-Clause
#include "python/glue/calls.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

namespace dyop::python {
namespace {

constexpr auto kPatience = std::chrono::milliseconds(50);  // between two checks for signals

// Waits without the lock until the work is done, and serves signals meanwhile.
class SignalWatch {
 public:
  void finish() {
    const std::lock_guard guard(mutex_);
    is_done_ = true;
    changed_.notify_all();
  }
  void wait(std::stop_source& source) {
    std::unique_lock guard(mutex_);
    while (!changed_.wait_for(guard, kPatience, [this] { return is_done_; })) {
      guard.unlock();
      {
        const py::gil_scoped_acquire lock;
        if (!interruption_ && PyErr_CheckSignals() != 0) {
          interruption_ = std::make_unique<py::error_already_set>();
          source.request_stop();
        }
      }
      guard.lock();
    }
  }
  std::unique_ptr<py::error_already_set> take_interruption() { return std::move(interruption_); }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_done_ = false;
  std::unique_ptr<py::error_already_set> interruption_;
};

}  // namespace

void run_interruptible(const std::stop_token& stop,
                       const std::function<void(std::stop_token)>& work) {
  std::stop_source source;
  const std::stop_callback forward(stop, [&] { source.request_stop(); });
  SignalWatch watch;
  std::exception_ptr failure;
  {
    const py::gil_scoped_release unlocked;
    std::jthread worker([&] {
      try {
        work(source.get_token());
      } catch (...) {
        failure = std::current_exception();
      }
      watch.finish();
    });
    watch.wait(source);
  }
  if (const auto interruption = watch.take_interruption()) throw std::move(*interruption);
  if (failure) std::rethrow_exception(failure);
}

std::function<void(std::size_t, std::size_t)> make_progress(const py::object& progress) {
  const py::object call = py::module_::import("dyop._progress").attr("call_of")(progress);
  if (call.is_none()) return {};
  using Clock = std::chrono::steady_clock;
  // Calls of a batch never overlap.
  auto last = std::make_shared<Clock::time_point>();
  return [call = StepFunction{SharedObject(call)}, last](std::size_t done, std::size_t total) {
    const Clock::time_point now = Clock::now();
    if (done < total && now - *last < std::chrono::milliseconds(100)) return;
    *last = now;
    call(done, total);
  };
}

}  // namespace dyop::python
