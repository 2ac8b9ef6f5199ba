// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstdint>

#include "dyop/core/error.h"
#include "dyop/view/run_files.h"

namespace dyop {
namespace view_internal {

// The bundled page, or nothing if dyop was built without it (page_bytes.cpp.in, missing_parts.cpp).
std::string_view page_bytes();

}  // namespace view_internal

namespace {

constexpr std::string_view kTitlePlace = "<!--dyop:title-->";
constexpr std::string_view kDataPlace = "<!--dyop:data-->";

std::size_t base64_size(std::string_view bytes) {
  return (bytes.size() + 2) / 3 * 4;
}

using DigitPair = std::array<char, 2>;

// The two digits of each number of 12 bits.
constexpr std::array<DigitPair, 4096> kDigitPairs = [] {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<DigitPair, 4096> pairs{};
  for (std::size_t k = 0; k < pairs.size(); ++k) pairs[k] = {kDigits[k >> 6], kDigits[k & 63]};
  return pairs;
}();

void append_base64(std::string_view bytes, std::string& text) {
  std::size_t at = text.size();
  text.resize(at + base64_size(bytes));
  const auto byte = [&](std::size_t k) {
    return k < bytes.size() ? std::uint32_t(std::uint8_t(bytes[k])) : 0u;
  };
  for (std::size_t k = 0; k < bytes.size(); k += 3, at += 4) {
    const std::uint32_t group = byte(k) << 16 | byte(k + 1) << 8 | byte(k + 2);
    std::ranges::copy(kDigitPairs[group >> 12], &text[at]);
    std::ranges::copy(kDigitPairs[group & 4095], &text[at + 2]);
  }
  const std::size_t missing = (3 - bytes.size() % 3) % 3;
  std::fill_n(text.end() - std::ptrdiff_t(missing), missing, '=');
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

// `append_data` writes `data_size` bytes to the end of a text.
template <typename Append>
std::string filled_page(std::string_view title, std::size_t data_size, Append append_data) {
  DYOP_REQUIRE(has_page(),
               "this dyop was built without the page that plays recordings: it needs "
               "npm packages (bash .ci/install.sh page) when it is built");
  std::string page;
  const std::string words = escaped(title);
  page.reserve(view_internal::page_bytes().size() + words.size() + data_size);
  std::string_view rest = view_internal::page_bytes();
  const auto copy_until = [&](std::string_view place) {
    const std::size_t at = rest.find(place);
    if (at == std::string_view::npos) throw InternalError("the page has no " + std::string(place));
    page += rest.substr(0, at);
    rest = rest.substr(at + place.size());
  };
  copy_until(kTitlePlace);
  page += words;
  copy_until(kDataPlace);
  append_data(page);
  page += rest;
  return page;
}

}  // namespace

bool has_page() {
  return !view_internal::page_bytes().empty();
}

std::string page_html(std::string_view title, std::span<const std::string> blocks) {
  constexpr std::string_view kBegin = "<script type=\"text/plain\" class=\"block\">";
  constexpr std::string_view kEnd = "</script>\n";
  std::size_t size = 0;
  for (const std::string& block : blocks) size += kBegin.size() + base64_size(block) + kEnd.size();
  return filled_page(title, size, [&](std::string& page) {
    for (const std::string& block : blocks) {
      page += kBegin;
      append_base64(block, page);
      page += kEnd;
    }
  });
}

std::string live_page_html(std::string_view title) {
  constexpr std::string_view kLive = "<script type=\"text/plain\" id=\"live\"></script>";
  return filled_page(title, kLive.size(), [&](std::string& page) { page += kLive; });
}

}  // namespace dyop
