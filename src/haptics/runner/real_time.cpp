// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/runner/real_time.h"

#include <cstring>

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#endif

namespace dyop::haptics_internal {

#ifdef __linux__

RealTime::RealTime(bool is_wanted) {
  if (!is_wanted) {
    words_ = "no real-time rights were asked for";
    return;
  }
  sched_param priority{};
  priority.sched_priority = sched_get_priority_max(SCHED_FIFO) / 2;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
  has_priority_ = error == 0;
  words_ = has_priority_ ? "real-time priority (SCHED_FIFO)"
                         : std::string("no real-time priority: ") + std::strerror(error);
  has_locked_memory_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  words_ += has_locked_memory_ ? ", memory is locked"
                               : std::string(", memory is not locked: ") + std::strerror(errno);
}

RealTime::~RealTime() {
  if (has_locked_memory_) munlockall();
  if (!has_priority_) return;
  const sched_param priority{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &priority);
}

#else

RealTime::RealTime(bool /*is_wanted*/) : words_("no real-time rights on this system") {}
RealTime::~RealTime() = default;

#endif

}  // namespace dyop::haptics_internal
