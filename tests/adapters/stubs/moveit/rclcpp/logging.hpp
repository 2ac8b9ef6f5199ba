// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <cstdio>
#include <rclcpp/logger.hpp>
#include <string>
#include <vector>

namespace rclcpp::stub {
// For tests: all errors so far.
inline std::vector<std::string>& errors() {
  static std::vector<std::string> list;
  return list;
}

inline void log_error(const Logger&, const char* /*format*/, const char* text) {
  errors().emplace_back(text);
}
}  // namespace rclcpp::stub

#define RCLCPP_ERROR(logger, ...) ::rclcpp::stub::log_error(logger, __VA_ARGS__)
