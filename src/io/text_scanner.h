// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::io_internal {

/// The text after the mark that some programs put in front of UTF-8.
std::string_view without_byte_order_mark(std::string_view text);

/// Walks through a text file line by line, split at whitespace, and throws FileErrors with the
/// current line number.
class TextScanner {
 public:
  TextScanner(const std::filesystem::path& file, std::string_view text)
      : file_(file), rest_(without_byte_order_mark(text)) {}

  /// Goes to the next line; false at the end of the text. If `joins_lines`, a backslash at the end
  /// of a line joins it with the next one.
  bool next_line(bool joins_lines = false);

  /// Goes to the next line with at least one word, ignoring everything from '#' on.
  bool next_line_with_words();

  const std::vector<std::string_view>& words() const { return words_; }
  void drop_comment();
  std::size_t line() const { return line_; }
  std::string_view rest() const { return rest_; }

  /// The word as a number; throws unless it is a finite number. `what` names it.
  Scalar finite_number(std::string_view word, std::string_view what) const;
  std::int64_t integer(std::string_view word, std::string_view what) const;

  [[noreturn]] void fail(const std::string& problem) const;
  [[noreturn]] void fail_at(std::size_t line, const std::string& problem) const;

 private:
  std::filesystem::path file_;
  std::string_view rest_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
};

/// The word as an integer, or nothing.
std::optional<std::int64_t> parse_integer(std::string_view word);

/// A word in quotation marks, shortened and cleaned to fit into a one-line message.
std::string quote(std::string_view word);

}  // namespace dyop::io_internal
