// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Asked between the small pieces of a longer computation whether to stop: by a deadline, for
/// instance. Once it has said yes, it goes on saying so.
class Interrupt {
 public:
  virtual bool is_over() = 0;

 protected:
  ~Interrupt() = default;
};

/// False if there is none.
inline bool is_over(Interrupt* interrupt) {
  return interrupt && interrupt->is_over();
}

}  // namespace dyop
