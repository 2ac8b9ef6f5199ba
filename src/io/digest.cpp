// SPDX-License-Identifier: BSD-3-Clause
#include "io/digest.h"

namespace dyop::io_internal {

namespace {

constexpr std::uint64_t kOffsetBasis = 0xcbf29ce484222325u;
constexpr std::uint64_t kPrime = 0x100000001b3u;

}  // namespace

std::uint64_t digest_of(std::string_view bytes) {
  std::uint64_t hash = kOffsetBasis;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * kPrime;
  return hash;
}

std::uint64_t digest_of(std::span<const std::uint64_t> words) {
  std::uint64_t hash = kOffsetBasis;
  for (const std::uint64_t word : words) hash = (hash ^ word) * kPrime;
  return hash;
}

std::string hex_digits(std::uint64_t value) {
  std::string digits(16, '0');
  for (std::size_t i = digits.size(); i-- > 0; value >>= 4)
    digits[i] = "0123456789abcdef"[value & 15u];
  return digits;
}

}  // namespace dyop::io_internal
