// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/core/error.h"

namespace dyop::testing {

/// The message of the exception that `action` throws.
template <typename Exception = InvalidArgument>
std::string message_of(const auto& action) {
  try {
    action();
  } catch (const Exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace dyop::testing
