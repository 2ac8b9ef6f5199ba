// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/error.h"

namespace dyop::core_internal {

/// Passes the message to the handler, then aborts.
DYOP_EXPORT [[noreturn]] void fail_assert(const char* file, int line, const char* condition,
                                          const std::string& values);

}  // namespace dyop::core_internal

/// Checks an internal assumption, never what a caller promised (that is DYOP_REQUIRE). On with
/// DYOP_ENABLE_ASSERTS: Debug and sanitizer builds. Usage: DYOP_ASSERT(lower <= upper, lower, ' ',
/// upper). The condition must be false for NaN, and neither it nor the values may have side
/// effects.
#ifdef DYOP_ENABLE_ASSERTS
#define DYOP_ASSERT(condition, ...)                                                            \
  do {                                                                                         \
    if (!(condition)) {                                                                        \
      ::dyop::core_internal::fail_assert(__FILE__, __LINE__, #condition,                       \
                                         ::dyop::core_internal::compose_message(__VA_ARGS__)); \
    }                                                                                          \
  } while (false)
#else
#define DYOP_ASSERT(condition, ...) static_cast<void>(sizeof(!(condition)))
#endif
