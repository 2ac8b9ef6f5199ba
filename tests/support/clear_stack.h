// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/core/types.h"

namespace dyop::testing {

// Fills the part of the stack that the next call uses, so that what it reads before it has written
// it is no leftover of a call alike.
[[gnu::noinline]] inline void clear_stack() {
  std::array<volatile Scalar, 512> numbers;
  for (volatile Scalar& x : numbers) x = 0;
}

}  // namespace dyop::testing
