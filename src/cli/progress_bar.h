// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>

namespace dyop::cli {

/// One line on stderr that is rewritten at most ten times a second and erased at the end. Silent
/// unless stderr is a terminal. Shortened to fit a narrow one.
class ProgressBar {
 public:
  explicit ProgressBar(bool is_wanted);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// @param fraction Fraction of the simulated time done, 0 to 1.
  void update(double fraction, std::int64_t impacts);

 private:
  void draw(double fraction, std::int64_t impacts, double seconds) const;

  using Clock = std::chrono::steady_clock;
  bool is_shown_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_;
};

}  // namespace dyop::cli
