// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <ostream>
#include <stop_token>
#include <streambuf>
#include <string>
#include <string_view>
#include <thread>

/// Names come from files that somebody else wrote: they must not steer the terminal.
namespace dyop::cli {

/// The text with its control characters, but for newlines and tabs, and with those that turn the
/// order of text around, written as \xNN.
std::string printable(std::string_view text);

/// While it lives, a stream shows printable() texts.
class PrintableStream {
 public:
  explicit PrintableStream(std::ostream& stream);
  ~PrintableStream();
  PrintableStream(const PrintableStream&) = delete;
  PrintableStream& operator=(const PrintableStream&) = delete;

 private:
  class Filter final : public std::streambuf {
   public:
    explicit Filter(std::streambuf* sink) : sink_(sink) {}
    std::streambuf* sink() const { return sink_; }

   private:
    int_type overflow(int_type c) override;
    std::streamsize xsputn(const char* text, std::streamsize count) override;
    int sync() override { return sink_->pubsync(); }

    std::streambuf* sink_;
  };

  std::ostream& stream_;
  Filter filter_;
};

/// While this object lives, the first SIGINT or SIGTERM requests a stop instead of ending the
/// process, so that partial results can be printed; the second one ends the process. Create it
/// before any thread.
///
/// A thread of its own waits for the signals: a signal handler may not call request_stop().
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  std::stop_token token() const { return interrupted_.get_token(); }
  /// Until the first signal.
  void wait() const;

 private:
  std::stop_source interrupted_;
  std::jthread waiter_;
};

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
