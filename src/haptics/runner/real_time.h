// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dyop::haptics_internal {

/// Gives the calling thread real-time priority and locks the process's memory, where the system
/// allows it, until destroyed.
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

}  // namespace dyop::haptics_internal
