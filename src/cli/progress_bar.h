// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>

namespace dyop::cli {

/// One line on stderr that is rewritten at most ten times a second and erased at the end. Silent
/// unless stderr is a terminal. Shortened to fit a narrow one.
class ProgressBar {
 public:
  /// @param unit What is counted, in the singular.
  explicit ProgressBar(bool is_wanted, const char* unit = "impact");
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// @param fraction Fraction of the work done, 0 to 1.
  void update(double fraction, std::int64_t count);

 private:
  void draw(double fraction, std::int64_t count, double seconds) const;

  using Clock = std::chrono::steady_clock;
  bool is_shown_;
  const char* unit_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_;
};

}  // namespace dyop::cli
