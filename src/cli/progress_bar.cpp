// SPDX-License-Identifier: BSD-3-Clause
#include "cli/progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>

namespace dyop::cli {
namespace {

// Columns of the terminal; 80 if unknown.
int terminal_width() {
  winsize size{};
  const bool is_known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return is_known ? size.ws_col : 80;
}

}  // namespace

ProgressBar::ProgressBar(bool is_wanted, const char* unit)
    : is_shown_(is_wanted && isatty(STDERR_FILENO) == 1), unit_(unit), last_(begin_) {
  if (is_shown_) draw(0, 0, 0);
}

ProgressBar::~ProgressBar() {
  if (is_shown_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(double fraction, std::int64_t count) {
  if (!is_shown_) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  draw(fraction, count, std::chrono::duration<double>(now - begin_).count());
}

void ProgressBar::draw(double fraction, std::int64_t count, double seconds) const {
  char numbers[80];
  std::snprintf(numbers, sizeof numbers, "%3.0f%%  %lld %s%s  %.1f s", 100 * fraction,
                static_cast<long long>(count), unit_, count == 1 ? "" : "s", seconds);
  std::string line;
  // One column stays free: some terminals would wrap a full line.
  const int space = terminal_width() - 1 - int(std::string_view(numbers).size() + 3);
  constexpr int kNarrowest = 5;
  if (const int width = std::min(30, space); width >= kNarrowest) {
    const int done = std::clamp(int(fraction * width), 0, width);
    line.append(1, '[').append(std::size_t(done), '#').append(std::size_t(width - done), '.');
    line += "] ";
  }
  line += numbers;
  line.resize(std::min(line.size(), std::size_t(std::max(0, terminal_width() - 1))));
  std::fprintf(stderr, "\r%s\033[K", line.c_str());
  std::fflush(stderr);
}

}  // namespace dyop::cli
