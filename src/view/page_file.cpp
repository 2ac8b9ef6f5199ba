// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/page_file.h"

#include <cstdint>

#include "dyop/core/error.h"
#include "view/page_bytes.h"

namespace dyop {
namespace {

constexpr std::string_view kTitlePlace = "<!--dyop:title-->";
constexpr std::string_view kDataPlace = "<!--dyop:data-->";

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      group = group << 8 | (j < count ? std::uint8_t(bytes[k + j]) : 0u);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      text += j <= count ? kDigits[group >> (18 - 6 * j) & 63] : '=';
    }
  }
  return text;
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
  std::string page(view_internal::page_bytes());
  const auto fill = [&](std::string_view place, const std::string& text) {
    const std::size_t at = page.find(place);
    if (at == std::string::npos) throw InternalError("the page has no " + std::string(place));
    page.replace(at, place.size(), text);
  };
  fill(kTitlePlace, escaped(title));
  fill(kDataPlace, data);
  return page;
}

}  // namespace

bool has_page() {
  return !view_internal::page_bytes().empty();
}

std::string page_html(std::string_view title, std::span<const std::string> blocks) {
  std::string data;
  for (const std::string& block : blocks) {
    data += "<script type=\"text/plain\" class=\"block\">";
    data += base64(block);
    data += "</script>\n";
  }
  return filled_page(title, data);
}

std::string live_page_html(std::string_view title) {
  return filled_page(title, "<script type=\"text/plain\" id=\"live\"></script>");
}

}  // namespace dyop
