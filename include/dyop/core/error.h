// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <charconv>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Base of every exception that dyop throws.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller broke a documented condition; the message names the value.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// An error in dyop itself; the message holds what is needed to reproduce it.
class InternalError : public Error {
 public:
  using Error::Error;
};

namespace core_internal {

/// Writes one part of a message: a number with the fewest digits that read back to it exactly,
/// an Eigen vector or matrix as its numbers separated by blanks, anything else as it prints.
template <typename Part>
void write_part(std::ostream& out, const Part& part) {
  if constexpr (std::is_floating_point_v<Part>) {
    if (part != part) {
      out << "nan";  // without its sign, which means nothing
      return;
    }
    std::array<char, 64> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), part);
    out << std::string_view(digits.data(), std::size_t(end.ptr - digits.data()));
  } else if constexpr (requires { part.derived().coeff(0, 0); }) {
    for (auto row = part.rows() * 0; row < part.rows(); ++row) {
      for (auto column = part.cols() * 0; column < part.cols(); ++column) {
        if (row > 0 || column > 0) out << ' ';
        write_part(out, part.derived().coeff(row, column));
      }
    }
  } else {
    out << part;
  }
}

/// Joins the parts of an error message, see write_part().
template <typename... Parts>
std::string compose_message(const Parts&... parts) {
  std::ostringstream out;
  (write_part(out, parts), ...);
  return out.str();
}

}  // namespace core_internal
}  // namespace dyop

/// Checks what a caller promised; always on. Usage:
/// DYOP_REQUIRE(r >= 0, "radius must be >= 0, not ", r). The condition must be false for NaN: write
/// `x >= 0`, never `!(x < 0)`.
#define DYOP_REQUIRE(condition, ...)                                                      \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      throw ::dyop::InvalidArgument(::dyop::core_internal::compose_message(__VA_ARGS__)); \
    }                                                                                     \
  } while (false)

namespace DYOP_EXPORT dyop {

/// Called with one line, `<file>:<line>: <condition>: <values>`, when an internal assumption of
/// dyop fails, in builds that check them: Debug and sanitizers. The process aborts when the handler
/// returns.
using AssertHandler = void (*)(const std::string& message);

/// Sets the handler of the process and returns the previous one. Null, the default, prints the
/// message to standard error. Thread-safe.
AssertHandler set_assert_handler(AssertHandler handler);

}  // namespace dyop
