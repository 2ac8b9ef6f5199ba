#pragma once

#include <string>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Called with one line, `<file>:<line>: <condition>: <values>`, when an assumption of dyop itself
/// turns out wrong, in builds that check them: Debug and sanitizers. The process aborts when it
/// returns.
using AssertHandler = void (*)(const std::string& message);

/// Sets the handler of the process and returns the one before. Null, as at the start, prints the
/// message to the standard error. Thread-safe.
AssertHandler set_assert_handler(AssertHandler handler);

}  // namespace dyop
