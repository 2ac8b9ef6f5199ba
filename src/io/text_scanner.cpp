// SPDX-License-Identifier: BSD-3-Clause
#include "io/text_scanner.h"

#include <cmath>
#include <cstdlib>
#include <system_error>

#include "dyop/io/file_error.h"

namespace dyop::io_internal {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

void split(std::string_view line, std::vector<std::string_view>& words) {
  std::size_t k = 0;
  while (k < line.size()) {
    while (k < line.size() && is_blank(line[k])) ++k;
    const std::size_t begin = k;
    while (k < line.size() && !is_blank(line[k])) ++k;
    if (k > begin) words.push_back(line.substr(begin, k - begin));
  }
}

std::string_view without_plus(std::string_view word) {
  return !word.empty() && word.front() == '+' ? word.substr(1) : word;
}

}  // namespace

std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

bool TextScanner::next_line(bool joins_lines) {
  words_.clear();
  if (rest_.empty()) return false;
  bool goes_on = true;
  while (goes_on && !rest_.empty()) {
    ++line_;
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    goes_on = joins_lines && !line.empty() && line.back() == '\\';
    if (goes_on) line.remove_suffix(1);
    split(line, words_);
  }
  return true;
}

bool TextScanner::next_line_with_words() {
  while (next_line()) {
    drop_comment();
    if (!words_.empty()) return true;
  }
  return false;
}

void TextScanner::drop_comment() {
  for (std::size_t k = 0; k < words_.size(); ++k) {
    const std::size_t hash = words_[k].find('#');
    if (hash == std::string_view::npos) continue;
    words_[k] = words_[k].substr(0, hash);
    words_.resize(words_[k].empty() ? k : k + 1);
    return;
  }
}

Scalar TextScanner::finite_number(std::string_view word, std::string_view what) const {
  Scalar value = 0;
  const std::string_view digits = without_plus(word);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  // Numbers too small for a double become zero; from_chars reports them as out of range.
  if (error == std::errc::result_out_of_range)
    value = std::strtod(std::string(word).c_str(), nullptr);
  const bool is_number =
      end == digits.data() + digits.size() && error != std::errc::invalid_argument;
  if (!is_number || !std::isfinite(value)) {
    fail(std::string(what) + ": expected a finite number, found " + quote(word));
  }
  return value;
}

std::int64_t TextScanner::integer(std::string_view word, std::string_view what) const {
  const std::optional<std::int64_t> value = parse_integer(word);
  if (!value) fail(std::string(what) + ": expected an integer, found " + quote(word));
  return *value;
}

void TextScanner::fail(const std::string& problem) const {
  fail_at(line_, problem);
}

void TextScanner::fail_at(std::size_t line, const std::string& problem) const {
  throw FileError(file_, FilePosition{line, std::nullopt}, problem);
}

std::optional<std::int64_t> parse_integer(std::string_view word) {
  std::int64_t value = 0;
  const std::string_view digits = without_plus(word);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

std::string quote(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string clean(word.substr(0, kLongest));
  for (char& c : clean) {
    if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') c = '?';
  }
  return "'" + clean + (word.size() > kLongest ? "...'" : "'");
}

}  // namespace dyop::io_internal
