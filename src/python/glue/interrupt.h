// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <stop_token>

#include "dyop/core/batch_options.h"
#include "python/glue/arguments.h"

namespace dyop::python {

/// Runs work(token) without the interpreter's lock while Ctrl-C and other signals of Python are
/// served: an exception of a handler requests a stop, and is thrown when the work has ended. The
/// work may also be stopped by `stop`.
void run_interruptible(const std::stop_token& stop,
                       const std::function<void(std::stop_token)>& work);

/// A callback for BatchOptions: calls progress(done, total) at most ten times a second, and at the
/// end. Empty for None.
std::function<void(std::size_t, std::size_t)> make_progress(const py::object& progress);

}  // namespace dyop::python
