// SPDX-License-Identifier: BSD-3-Clause
#include "cli/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <string>
#include <string_view>

namespace dyop::cli {
namespace {

// The bytes of a character that steers a terminal and begins at `at`; 0 if another character does.
std::size_t control_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char c = byte(at);
  if ((c < ' ' && c != '\n' && c != '\t') || c == 0x7F) return 1;
  // U+0080 to U+009F in UTF-8.
  const bool is_c1 =
      c == 0xC2 && at + 1 < text.size() && byte(at + 1) >= 0x80 && byte(at + 1) < 0xA0;
  if (is_c1) return 2;
  // What turns the order of text around: U+200E, U+200F, U+202A to U+202E, U+2066 to U+2069.
  if (c != 0xE2 || at + 2 >= text.size()) return 0;
  const unsigned char second = byte(at + 1);
  const unsigned char third = byte(at + 2);
  const bool is_mark = second == 0x80 && (third == 0x8E || third == 0x8F);
  const bool is_embedding = second == 0x80 && third >= 0xAA && third <= 0xAE;
  const bool is_isolate = second == 0x81 && third >= 0xA6 && third <= 0xA9;
  return is_mark || is_embedding || is_isolate ? 3 : 0;
}

}  // namespace

std::string printable(std::string_view text) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = control_length(text, i);
    if (length == 0) {
      shown += text[i++];
      continue;
    }
    for (const std::size_t end = i + length; i < end; ++i) {
      const auto c = static_cast<unsigned char>(text[i]);
      shown.append({'\\', 'x', kDigits[c >> 4], kDigits[c & 15]});
    }
  }
  return shown;
}

PrintableStream::PrintableStream(std::ostream& stream) : stream_(stream), filter_(stream.rdbuf()) {
  stream_.rdbuf(&filter_);
}

PrintableStream::~PrintableStream() {
  stream_.flush();
  stream_.rdbuf(filter_.sink());
}

PrintableStream::Filter::int_type PrintableStream::Filter::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  const char character = traits_type::to_char_type(c);
  return xsputn(&character, 1) == 1 ? c : traits_type::eof();
}

std::streamsize PrintableStream::Filter::xsputn(const char* text, std::streamsize count) {
  const std::string shown = printable({text, std::size_t(count)});
  const auto length = std::streamsize(shown.size());
  return sink_->sputn(shown.data(), length) == length ? count : 0;
}

namespace {

sigset_t watched_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) {
    // A shell starts background jobs with SIGINT ignored; keep it so.
    struct sigaction action {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN) sigaddset(&signals, signal);
  }
  return signals;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals](const std::stop_token& finished) {
    constexpr timespec kPatience{0, 50'000'000};  // longest wait of the destructor
    while (!finished.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &kPatience) < 0) continue;
      interrupted_.request_stop();
      pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // the next signal has its default effect
    }
  });
}

void InterruptGuard::wait() const {
  std::mutex mutex;
  std::condition_variable_any ended;
  std::unique_lock lock(mutex);
  ended.wait(lock, token(), [] { return false; });
}

InterruptGuard::~InterruptGuard() {
  waiter_.request_stop();
  waiter_.join();
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

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
