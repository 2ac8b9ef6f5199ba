// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace console_bridge::stub {
// For tests: all errors so far.
inline std::vector<std::string>& errors() {
  static std::vector<std::string> list;
  return list;
}

template <typename... Arguments>
void log_error(const char* format, Arguments... arguments) {
  std::array<char, 1000> text{};
  std::snprintf(text.data(), text.size(), format, arguments...);
  errors().emplace_back(text.data());
}
}  // namespace console_bridge::stub

#define CONSOLE_BRIDGE_logError(...) ::console_bridge::stub::log_error(__VA_ARGS__)
