// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_tick.h"

#include "dyop/core/error.h"

namespace dyop {

const char* words_of(HapticStatus status) {
  switch (status) {
    case HapticStatus::NotRun:
      return "not run";
    case HapticStatus::Free:
      return "free";
    case HapticStatus::Held:
      return "held by contact";
    case HapticStatus::Blocked:
      return "behind the device";
    case HapticStatus::Deadline:
      return "cut off by a limit";
    case HapticStatus::Trapped:
      return "trapped, tissue stopped";
    case HapticStatus::Recovering:
      return "leaving a margin";
    case HapticStatus::Overlapping:
      return "leaving tissue";
    case HapticStatus::InvalidInput:
      return "bad input";
    case HapticStatus::Outlier:
      return "outlier ignored";
  }
  throw InternalError("unknown status of a tick");
}

}  // namespace dyop
