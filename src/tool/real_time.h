// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dyop::internal {

/// A real-time priority for the calling thread, and the process's memory locked, for as long as this
/// lives and where the system allows it.
class RealTime {
 public:
  explicit RealTime(bool is_wanted);
  ~RealTime();
  RealTime(const RealTime&) = delete;
  RealTime& operator=(const RealTime&) = delete;

  bool has_priority() const { return has_priority_; }
  bool has_locked_memory() const { return has_locked_memory_; }
  /// What was granted, and why not.
  const std::string& words() const { return words_; }

 private:
  bool has_priority_ = false;
  bool has_locked_memory_ = false;
  std::string words_;
};

}  // namespace dyop::internal
