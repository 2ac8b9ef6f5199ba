// SPDX-License-Identifier: BSD-3-Clause
#include "core/assert.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace dyop {
namespace {

// The only process-wide state in dyop: the handler that receives its last message.
std::atomic<AssertHandler> the_handler{nullptr};

}  // namespace

AssertHandler set_assert_handler(AssertHandler handler) {
  return the_handler.exchange(handler);
}

namespace core_internal {

void fail_assert(const char* file, int line, const char* condition, const std::string& values) {
  const std::string message = compose_message(file, ':', line, ": ", condition, ": ", values);
  if (const AssertHandler handler = the_handler.load()) {
    handler(message);
  } else {
    std::fprintf(stderr, "%s\n", message.c_str());
  }
  std::abort();
}

}  // namespace core_internal
}  // namespace dyop
