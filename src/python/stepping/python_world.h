// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <any>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/dynamics/world.h"
#include "dyop/dynamics/world_options.h"
#include "dyop/io/scene_file.h"
#include "python/glue/arguments.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"

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
  /// After each step, without the interpreter's lock: the user's function, then signals.
  void step(const std::function<void(Scalar)>& on_step, Scalar t) {
    if (on_step) {
      const Between between(is_between_steps_);
      on_step(t);
    }
    check();
  }
  /// In the advancing thread: whether the user's on_step runs.
  bool is_between_steps() const { return is_between_steps_; }
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
  struct Between {
    bool& flag;
    explicit Between(bool& set) : flag(set) { flag = true; }
    ~Between() { flag = false; }
    Between(const Between&) = delete;
    Between& operator=(const Between&) = delete;
  };
  static constexpr auto kPatience = std::chrono::milliseconds(50);
  std::stop_source source_;
  bool is_between_steps_ = false;
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
    const std::function<void(Scalar)> user = options.on_step;
    options.on_step = [watch, user](Scalar t) { watch->step(user, t); };
    return std::unique_ptr<PythonWorld>(new PythonWorld(build(options), watch, user));
  }

  /// For members that change nothing: also from callbacks in the advancing thread.
  World& read() {
    DYOP_REQUIRE(!is_advancing_ || thread_ == std::this_thread::get_id(),
                 "the World is being advanced by another thread");
    return world_;
  }
  World& change() {
    DYOP_REQUIRE(!is_advancing_, "the World cannot be changed while it is being advanced");
    DYOP_REQUIRE(askers_ == 0, "the World cannot be changed while it answers a query");
    return world_;
  }
  /// Calls query(world, filter), which may give the lock back: one query at a time, others wait,
  /// and the World cannot be changed meanwhile. A filter's function may ask as well, and on_step.
  /// @param filter Null: all bodies.
  template <typename Query>
  auto ask(const BodyFilter* filter, const Query& query) {
    DYOP_REQUIRE(
        !is_advancing_ || (thread_ == std::this_thread::get_id() && watch_->is_between_steps()),
        "a World that is being advanced answers queries in on_step only");
    BodyFilter used = filter != nullptr ? *filter : BodyFilter();
    if (used.accepts) {
      used.accepts = [this, accepts = used.accepts](BodyId id) {
        const Within within(this);
        return accepts(id);
      };
    }
    const Count count(askers_);
    std::unique_lock<std::mutex> turn(asking_, std::defer_lock);
    if (within_answer_of_ != this) {
      const py::gil_scoped_release unlocked;
      turn.lock();
    }
    return query(static_cast<const World&>(world_), static_cast<const BodyFilter&>(used));
  }
  /// With the user's own on_step.
  WorldOptions options() {
    WorldOptions options = read().options();
    options.on_step = on_step_;
    return options;
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

  // The World whose query calls a filter in this thread.
  static inline thread_local const PythonWorld* within_answer_of_ = nullptr;
  struct Within {
    const PythonWorld* before;
    explicit Within(const PythonWorld* world) : before(std::exchange(within_answer_of_, world)) {}
    ~Within() { within_answer_of_ = before; }
    Within(const Within&) = delete;
    Within& operator=(const Within&) = delete;
  };
  struct Count {
    int& number;
    explicit Count(int& counted) : number(counted) { ++number; }
    ~Count() { --number; }
    Count(const Count&) = delete;
    Count& operator=(const Count&) = delete;
  };

  PythonWorld(World world, std::shared_ptr<AdvanceWatch> watch, std::function<void(Scalar)> on_step)
      : world_(std::move(world)), watch_(std::move(watch)), on_step_(std::move(on_step)) {}

  World world_;
  std::shared_ptr<AdvanceWatch> watch_;
  std::function<void(Scalar)> on_step_;
  std::mutex asking_;
  bool is_advancing_ = false;  // like the next two under the lock
  std::thread::id thread_;
  int askers_ = 0;
};

/// A Wrench or a pair (force, torque).
inline Wrench read_wrench(const py::object& value) {
  if (py::isinstance<Wrench>(value)) return value.cast<Wrench>();
  const Twist pair = twist_of(value);  // two vectors as well
  return {pair.v_WB, pair.w_WB};
}
using WrenchFunction = PythonFunction<&read_wrench>;

/// Calls function(event, states) and takes over what it wrote into states.
struct ImpactFunction {
  SharedObject function;

  void operator()(const ImpactEvent& event, ImpactStates& states) const {
    const py::gil_scoped_acquire lock;
    const py::object shown = py::cast(states, py::return_value_policy::copy);
    function.get()(event, shown);
    states = shown.cast<ImpactStates&>();
  }
};

/// The Python function within a std::function, None if it is empty. One that was made by C++ cannot
/// be called from Python: an Ellipsis stands for it.
template <typename Function, typename StdFunction>
py::object python_function(const StdFunction& function) {
  if (!function) return py::none();
  const auto* own = function.template target<Function>();
  return own != nullptr ? own->function.get() : py::object(py::ellipsis());
}

/// The other direction. An Ellipsis leaves the function as it is.
template <typename Function, typename StdFunction>
void set_function(StdFunction& function, py::handle value) {
  if (value.is(py::ellipsis())) return;
  if (value.is_none()) {
    function = nullptr;
    return;
  }
  if (PyCallable_Check(value.ptr()) == 0) throw py::type_error("a function is wanted");
  function = Function{SharedObject(py::reinterpret_borrow<py::object>(value))};
}

/// A field of a record T that holds a function.
template <typename T, auto kMember, typename Function>
Field function_field(const char* name) {
  return {name,
          [](const void* r, py::handle) {
            return python_function<Function>(static_cast<const T*>(r)->*kMember);
          },
          [](void* r, py::handle value) {
            set_function<Function>(static_cast<T*>(r)->*kMember, value);
          }};
}

inline py::object object_in(const std::any& data) {
  const auto* held = std::any_cast<SharedObject>(&data);
  return held != nullptr ? held->get() : py::object(py::none());
}

/// A scene, and where it came from.
struct PythonScene {
  Scene scene;
  std::filesystem::path file;
  std::vector<std::filesystem::path> mesh_directories;
};

}  // namespace dyop::python
