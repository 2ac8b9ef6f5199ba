#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace dyop {

/// Root of every exception that dyop throws.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller broke a documented condition; the message names the value.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// dyop itself is wrong; the message holds what is needed to reproduce it.
class InternalError : public Error {
 public:
  using Error::Error;
};

namespace internal {

/// Joins the parts of an error message. Numbers are printed so that they read back exactly.
template <typename... Parts>
std::string compose_message(const Parts&... parts) {
  std::ostringstream out;
  out.precision(17);
  (out << ... << parts);
  return out.str();
}

}  // namespace internal
}  // namespace dyop

/// Checks what a caller promised; always on. Usage: DYOP_REQUIRE(r >= 0, "radius must be >= 0, not
/// ", r). The condition must be false for NaN: write `x >= 0`, never `!(x < 0)`.
#define DYOP_REQUIRE(condition, ...)                                                 \
  do {                                                                               \
    if (!(condition)) {                                                              \
      throw ::dyop::InvalidArgument(::dyop::internal::compose_message(__VA_ARGS__)); \
    }                                                                                \
  } while (false)
