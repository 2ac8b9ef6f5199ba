// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"
#include "python/glue/arguments.h"
#include "python/glue/derived.h"

namespace dyop::python {

/// One thread updates a session, and others give tissue. Updates hold the interpreter's lock unless
/// a runner makes them; giving does not hold it.
class PythonSession {
 public:
  PythonSession(const HapticScene& scene, const HapticOptions& options) : session_(scene, options) {
    for (const HapticTool& tool : scene.tools()) {
      DevicePose& device = start_.emplace_back(tool.X_WT);
      device.angles = tool.start().angles;
    }
  }

  /// For what a runner must not be disturbed in.
  HapticSession& own() {
    DYOP_REQUIRE(!is_running_, "the session is run by a HapticRunner; stop that first");
    return session_;
  }
  /// A repr, which does not disturb a runner.
  std::string describe() const {
    if (is_running_) return "HapticSession(running)";
    return "HapticSession(" + std::to_string(session_.tool_count()) +
           (session_.tool_count() == 1 ? " tool" : " tools") +
           ", time=" + std::string(py::repr(py::cast(session_.time()))) + ")";
  }
  /// Devices where the tools start.
  const std::vector<DevicePose>& start() const { return start_; }

  /// Calls give(session) without the interpreter's lock.
  template <typename Give>
  auto give(const Give& give) {
    const py::gil_scoped_release unlocked;
    return give(session_);
  }

  HapticSession& start_running() {
    own();
    is_running_ = true;
    return session_;
  }
  void end_running() { is_running_ = false; }

 private:
  HapticSession session_;
  std::vector<DevicePose> start_;
  std::atomic<bool> is_running_{false};
};

/// The interpreter's lock, while a model or function of Python is asked for tissue.
class TissueCall {
 public:
  TissueCall() { ++depth(); }
  ~TissueCall() { --depth(); }
  TissueCall(const TissueCall&) = delete;
  TissueCall& operator=(const TissueCall&) = delete;

  /// Whether this thread is in such a call: it cannot wait for a runner to end, which may wait for
  /// the call.
  static bool is_running() { return depth() > 0; }

 private:
  static int& depth() {
    thread_local int count = 0;
    return count;
  }
  py::gil_scoped_acquire lock_;
};

/// A DevicePose, a pose, or a pair (quaternion, position) of any numbers, unchecked.
DevicePose device_of(py::handle pose, const std::vector<Scalar>& angles);
std::vector<DevicePose> devices_of(const py::iterable& poses);

}  // namespace dyop::python

namespace pybind11::detail {

template <>
struct type_caster<std::shared_ptr<dyop::TissueModel>> : KeepingCaster<dyop::TissueModel> {};

}  // namespace pybind11::detail
