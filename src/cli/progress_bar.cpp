#include "cli/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace dyop::cli {

ProgressBar::ProgressBar(bool is_wanted)
    : is_shown_(is_wanted && isatty(STDERR_FILENO) == 1), last_(begin_) {}

ProgressBar::~ProgressBar() {
  if (is_shown_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(double fraction, std::int64_t impacts) {
  if (!is_shown_) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  constexpr int kWidth = 30;
  const int done = std::clamp(int(fraction * kWidth), 0, kWidth);
  const std::string bar =
      std::string(std::size_t(done), '#') + std::string(std::size_t(kWidth - done), '.');
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  std::fprintf(stderr, "\r[%s] %3.0f%%  %lld impacts  %.1f s\033[K", bar.c_str(), 100 * fraction,
               static_cast<long long>(impacts), seconds);
  std::fflush(stderr);
}

}  // namespace dyop::cli
