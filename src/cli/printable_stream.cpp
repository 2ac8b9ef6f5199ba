// SPDX-License-Identifier: BSD-3-Clause
#include "cli/printable_stream.h"

#include <cstddef>

namespace dyop::cli {
namespace {

// The bytes of a control character that begins at `at`; 0 if another character does.
std::size_t control_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char c = byte(at);
  if ((c < ' ' && c != '\n' && c != '\t') || c == 0x7F) return 1;
  // U+0080 to U+009F in UTF-8.
  const bool is_c1 =
      c == 0xC2 && at + 1 < text.size() && byte(at + 1) >= 0x80 && byte(at + 1) < 0xA0;
  return is_c1 ? 2 : 0;
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

}  // namespace dyop::cli
