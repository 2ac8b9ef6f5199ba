// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "dyop/core/error.h"
#include "dyop/dyop_c.h"

// Structs that start with the size known to the caller, which may differ from ours if the header is
// older or newer.
namespace dyop::c {

/// A struct has fields that this library does not know.
class Unsupported : public Error {
 public:
  using Error::Error;
};

/// The size of a struct in the first release that had it. When a struct grows, keep its old size
/// here.
template <typename Struct>
inline constexpr std::uint32_t kFirstSize = sizeof(Struct);
template <>
inline constexpr std::uint32_t kFirstSize<dyop_world_options> = 72;
template <>
inline constexpr std::uint32_t kFirstSize<dyop_body_definition> = 168;

/// Throws InvalidArgument for a size that no release had: a struct that was not initialised.
template <typename Struct>
void require_size(std::uint32_t size, const char* what) {
  DYOP_REQUIRE(size >= kFirstSize<Struct>, "the size of ", what, " is ", size, ", not at least ",
               kFirstSize<Struct>, ": start from its DYOP_..._INIT macro or set it");
}

/// What the caller wrote at `given`, with defaults for the fields it does not know. Fields unknown
/// to this library must be zero.
template <typename Struct>
Struct read_struct(const void* given, const Struct& defaults, const char* what) {
  if (!given) return defaults;
  std::uint32_t size = 0;
  std::memcpy(&size, given, sizeof(size));
  require_size<Struct>(size, what);
  Struct result = defaults;
  std::memcpy(&result, given, std::min<std::size_t>(size, sizeof(Struct)));
  const auto* bytes = static_cast<const unsigned char*>(given);
  if (std::any_of(bytes + std::min<std::size_t>(size, sizeof(Struct)), bytes + size,
                  [](unsigned char byte) { return byte != 0; })) {
    throw Unsupported(
        core_internal::compose_message(what, " has fields that this library, which knows ",
                                       sizeof(Struct), " bytes of it, does not know"));
  }
  return result;
}

/// Writes as much of `value` as fits a struct of this size, and zeros beyond.
template <typename Struct>
void write_struct(const Struct& value, std::uint32_t size, void* out) {
  std::memset(out, 0, size);
  std::memcpy(out, &value, std::min<std::size_t>(size, sizeof(Struct)));
  std::memcpy(out, &size, sizeof(size));
}

/// An array of the caller whose elements all have the size stated by the first one.
template <typename Struct, typename Bytes>
class SizedArray {
 public:
  /// @param data May be null if there are no elements.
  SizedArray(Bytes* data, std::size_t count, const char* what) : data_(data), what_(what) {
    if (count == 0) return;
    DYOP_REQUIRE(data, what, " must not be null");
    std::memcpy(&size_, data, sizeof(size_));
    require_size<Struct>(size_, what);
  }
  Struct read(std::size_t i) const {
    const Struct value = read_struct(data_ + i * size_, Struct(), what_);
    DYOP_REQUIRE(value.size == size_, what_, " ", i, " has the size ", value.size,
                 ", the first one has ", size_);
    return value;
  }
  void write(std::size_t i, const Struct& value) { write_struct(value, size_, data_ + i * size_); }

 private:
  Bytes* data_;
  const char* what_;
  std::uint32_t size_ = 0;
};

template <typename Struct>
SizedArray<Struct, const std::byte> sized_array(const Struct* data, std::size_t count,
                                                const char* what) {
  return {reinterpret_cast<const std::byte*>(data), count, what};
}

template <typename Struct>
SizedArray<Struct, std::byte> sized_array(Struct* data, std::size_t count, const char* what) {
  return {reinterpret_cast<std::byte*>(data), count, what};
}

}  // namespace dyop::c
