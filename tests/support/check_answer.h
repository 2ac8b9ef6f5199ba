// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <sstream>
#include <string>

#include "check/check.h"

/// What dyop-check says of a file.
namespace dyop::testing {

inline constexpr int kProven = 0;
inline constexpr int kRefuted = 1;
inline constexpr int kUnusable = 2;
inline constexpr int kUndecided = 3;

struct Answer {
  int code = 0;
  std::string text;
  std::string error;
};

inline Answer check(const std::filesystem::path& file, double scale = 1) {
  std::ostringstream out;
  std::ostringstream errors;
  const int code = dyop_check::check_file(file.string(), scale, out, errors);
  return {code, out.str(), errors.str()};
}

}  // namespace dyop::testing
