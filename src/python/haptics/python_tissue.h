// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/haptics/haptic_runner.h"
#include "python/glue/derived.h"

namespace dyop::python {

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
  pybind11::gil_scoped_acquire lock_;
};

}  // namespace dyop::python

namespace pybind11::detail {

template <>
struct type_caster<std::shared_ptr<dyop::TissueModel>> : KeepingCaster<dyop::TissueModel> {};

}  // namespace pybind11::detail
