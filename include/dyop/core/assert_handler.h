// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Called with one line, `<file>:<line>: <condition>: <values>`, when an internal assumption of
/// dyop fails, in builds that check them: Debug and sanitizers. The process aborts when the handler
/// returns.
using AssertHandler = void (*)(const std::string& message);

/// Sets the handler of the process and returns the previous one. Null, the default, prints the
/// message to standard error. Thread-safe.
AssertHandler set_assert_handler(AssertHandler handler);

}  // namespace dyop
