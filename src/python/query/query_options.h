// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stop_token>

#include "dyop/toi/least_distance.h"
#include "dyop/toi/time_of_impact.h"
#include "python/glue/record.h"

namespace dyop::python {

/// Options with the source of their stop token, which Python sees as `stop`.
template <typename Options>
struct Stoppable : Options {
  std::optional<std::stop_source> stop_source;
};
using PythonToiOptions = Stoppable<ToiOptions>;
using PythonLeastDistanceOptions = Stoppable<LeastDistanceOptions>;

/// The options, or the defaults for null.
template <typename Options>
Options options_or_default(const Stoppable<Options>* options) {
  return options != nullptr ? static_cast<const Options&>(*options) : Options();
}

/// A point in time of Python's time.monotonic(), in seconds.
std::chrono::steady_clock::time_point deadline_of(py::handle seconds);
py::object seconds_of(const std::optional<std::chrono::steady_clock::time_point>& deadline);

/// Adds the fields `deadline` and `stop`.
template <typename SomeRecord, typename Options>
void add_limits(SomeRecord& record, const Stoppable<Options>*) {
  using T = Stoppable<Options>;
  record.custom(
      {"deadline",
       [](const void* o, py::handle) { return seconds_of(static_cast<const T*>(o)->deadline); },
       [](void* o, py::handle value) {
         auto& deadline = static_cast<T*>(o)->deadline;
         deadline.reset();
         if (!value.is_none()) deadline = deadline_of(value);
       }},
      "Optional[float]: when to stop, in seconds of time.monotonic()");
  record.custom(
      {"stop",
       [](const void* o, py::handle) { return py::cast(static_cast<const T*>(o)->stop_source); },
       [](void* o, py::handle value) {
         auto* options = static_cast<T*>(o);
         options->stop_source = value.cast<std::optional<std::stop_source>>();
         options->stop =
             options->stop_source ? options->stop_source->get_token() : std::stop_token();
       }},
      "Optional[StopSource]: cancels the query");
}

}  // namespace dyop::python
