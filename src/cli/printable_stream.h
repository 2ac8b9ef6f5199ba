// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <streambuf>
#include <string>
#include <string_view>

/// Names come from files that somebody else wrote: they must not steer the terminal.
namespace dyop::cli {

/// The text with its control characters, but for newlines and tabs, written as \xNN.
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

}  // namespace dyop::cli
