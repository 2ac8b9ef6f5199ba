// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool/tool_tick.h"

#include "dyop/core/error.h"

namespace dyop {

const char* words_of(ToolStatus status) {
  switch (status) {
    case ToolStatus::NotRun:
      return "not run";
    case ToolStatus::Free:
      return "free";
    case ToolStatus::Held:
      return "held by contact";
    case ToolStatus::Blocked:
      return "behind the device";
    case ToolStatus::Deadline:
      return "cut off by a limit";
    case ToolStatus::Trapped:
      return "trapped, tissue stopped";
    case ToolStatus::Recovering:
      return "leaving a margin";
    case ToolStatus::Overlapping:
      return "leaving tissue";
    case ToolStatus::InvalidInput:
      return "bad input";
  }
  throw InternalError("unknown status of a tick");
}

}  // namespace dyop
