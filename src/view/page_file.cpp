// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
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

void append_base64(std::string_view bytes, std::string& text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::size_t at = text.size();
  text.resize(at + base64_size(bytes));
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      group = group << 8 | (j < count ? std::uint8_t(bytes[k + j]) : 0u);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text[at++] = j <= count ? kDigits[group >> (18 - 6 * j) & 63] : '=';
    }
  }
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

std::string filled_page(std::string_view title, const std::string& data) {
  DYOP_REQUIRE(has_page(),
               "this dyop was built without the page that plays recordings: it needs "
               "npm packages (bash .ci/install.sh page) when it is built");
  std::string page;
  page.reserve(view_internal::page_bytes().size() + title.size() + data.size());
  std::string_view rest = view_internal::page_bytes();
  const auto fill = [&](std::string_view place, std::string_view text) {
    const std::size_t at = rest.find(place);
    if (at == std::string_view::npos) throw InternalError("the page has no " + std::string(place));
    page += rest.substr(0, at);
    page += text;
    rest = rest.substr(at + place.size());
  };
  fill(kTitlePlace, escaped(title));
  fill(kDataPlace, data);
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
  std::string data;
  data.reserve(size);
  for (const std::string& block : blocks) {
    data += kBegin;
    append_base64(block, data);
    data += kEnd;
  }
  return filled_page(title, data);
}

std::string live_page_html(std::string_view title) {
  return filled_page(title, "<script type=\"text/plain\" id=\"live\"></script>");
}

}  // namespace dyop
