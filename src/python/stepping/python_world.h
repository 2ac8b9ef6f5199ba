// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <thread>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/dynamics/world.h"
#include "python/glue/arguments.h"

namespace dyop::python {

/// Serves Ctrl-C between the committed steps of an advance.
class AdvanceWatch {
 public:
  /// Before an advance. The token ends it.
  std::stop_token begin() {
    source_ = std::stop_source();
    interruption_.reset();
    return source_.get_token();
  }
  /// After each step, without the interpreter's lock.
  void check() {
    const auto now = std::chrono::steady_clock::now();
    if (interruption_ || now - last_ < kPatience) return;
    last_ = now;
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() == 0) return;
    interruption_ = std::make_unique<py::error_already_set>();
    source_.request_stop();
  }
  void request_stop() { source_.request_stop(); }
  /// After the advance, with the lock: throws what the handler of a signal threw.
  void rethrow() {
    if (const auto interruption = std::move(interruption_)) throw std::move(*interruption);
  }

 private:
  static constexpr auto kPatience = std::chrono::milliseconds(50);
  std::stop_source source_;
  std::chrono::steady_clock::time_point last_;
  std::unique_ptr<py::error_already_set> interruption_;
};

/// A World that refuses use from other threads, and changes by its own callbacks, while it
/// advances without the interpreter's lock.
class PythonWorld {
 public:
  static std::unique_ptr<PythonWorld> make(const WorldOptions& options) {
    return make_with(options, [](const WorldOptions& used) { return World(used); });
  }
  /// @param build Makes the World from the options it is handed.
  template <typename Build>
  static std::unique_ptr<PythonWorld> make_with(WorldOptions options, const Build& build) {
    auto watch = std::make_shared<AdvanceWatch>();
    options.on_step = [watch, user = options.on_step](Scalar t) {
      if (user) user(t);
      watch->check();
    };
    return std::unique_ptr<PythonWorld>(new PythonWorld(build(options), watch));
  }

  /// For members that change nothing: also from callbacks in the advancing thread.
  World& read() {
    DYOP_REQUIRE(!is_advancing_ || thread_ == std::this_thread::get_id(),
                 "the World is being advanced by another thread");
    return world_;
  }
  World& change() {
    DYOP_REQUIRE(!is_advancing_, "the World cannot be changed while it is being advanced");
    return world_;
  }
  bool is_advancing() const { return is_advancing_; }
  AdvanceReport advance(Scalar dt, AdvanceLimits limits) {
    World& world = change();
    const Guard guard(*this);
    AdvanceReport report;
    {
      const std::stop_token stop = std::exchange(limits.stop, watch_->begin());
      const std::stop_callback forward(stop, [this] { watch_->request_stop(); });
      const py::gil_scoped_release unlocked;
      report = world.advance(dt, limits);
    }
    watch_->rethrow();
    return report;
  }

 private:
  struct Guard {
    PythonWorld& world;
    explicit Guard(PythonWorld& guarded) : world(guarded) {
      world.thread_ = std::this_thread::get_id();
      world.is_advancing_ = true;
    }
    ~Guard() { world.is_advancing_ = false; }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;
  };

  PythonWorld(World world, std::shared_ptr<AdvanceWatch> watch)
      : world_(std::move(world)), watch_(std::move(watch)) {}

  World world_;
  std::shared_ptr<AdvanceWatch> watch_;
  bool is_advancing_ = false;  // both under the lock
  std::thread::id thread_;
};

}  // namespace dyop::python
