// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/time_interval.h"

/// What the fuzz targets share.
namespace dyop::fuzz {

/// Ends the process, which tells the fuzzer about a broken promise.
inline void require(bool is_kept, const std::string& promise) {
  if (is_kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise.c_str());
  std::abort();
}

/// A message for a person: one line, not empty, no control characters.
inline void require_readable(const std::string& message) {
  require(!message.empty(), "an error has a message");
  for (const char c : message) {
    const auto byte = static_cast<unsigned char>(c);
    require(byte >= 0x20 && byte != 0x7f, "an error's message is one readable line: " + message);
  }
}

/// Bytes as numbers, so that a change of a byte is a change of a number; zeros after the end. An
/// expression takes bytes once at most: the order of two would be the compiler's.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), rest_(size) {}

  bool is_empty() const { return rest_ == 0; }

  std::uint8_t byte() {
    if (rest_ == 0) return 0;
    --rest_;
    return *data_++;
  }

  bool flag() { return (byte() & 1) != 0; }

  /// 0 ... count - 1.
  int index(int count) { return byte() % count; }

  /// Any double, NaN and infinity included.
  Scalar any_number() {
    std::uint64_t bits = 0;
    for (int k = 0; k < 8; ++k) bits = bits << 8 | byte();
    return std::bit_cast<Scalar>(bits);
  }

  /// A finite number: small, special, any, or nearly one that came before, since coincidences are
  /// what breaks geometry.
  Scalar number() {
    const Scalar x = next_number();
    const Scalar finite = std::isfinite(x) ? x : 0;
    earlier_[count_++ % earlier_.size()] = finite;
    return finite;
  }

  /// A number whose magnitude is at most `limit`; larger ones are folded.
  Scalar number_within(Scalar limit) {
    const Scalar x = number();
    return std::abs(x) <= limit ? x : std::fmod(x, limit);
  }

  Vector3 vector_within(Scalar limit) {
    const Scalar x = number_within(limit);
    const Scalar y = number_within(limit);
    const Scalar z = number_within(limit);
    return {x, y, z};
  }

  RigidPose pose_within(Scalar limit) {
    const Vector3 turn = vector_within(8);
    return RigidPose(rotation_from_vector(turn), vector_within(limit));
  }

 private:
  Scalar small_number() {
    const auto high = std::int8_t(byte());
    return Scalar(high) / 16;
  }

  Scalar earlier() { return earlier_[byte() % earlier_.size()]; }

  Scalar next_number() {
    constexpr std::array<Scalar, 16> kSpecial{0,    -0.0, 1,     -1,      0.5,       1e-3,
                                              1e-6, 1e-9, 1e-16, 0x1p-52, 0x1p-1074, 0x1p-1022,
                                              1e3,  1e6,  1e12,  1e60};
    switch (byte() & 7) {
      case 0:
        return std::int8_t(byte());
      case 1:
        return small_number();
      case 2: {
        const Scalar x = small_number();
        return x + small_number() / 128;
      }
      case 3:
        return any_number();
      case 4:
        return kSpecial[byte() % kSpecial.size()];
      case 5:
        return earlier();
      case 6: {
        Scalar x = earlier();
        const bool up = flag();
        for (int k = index(4); k >= 0; --k) x = std::nextafter(x, up ? HUGE_VAL : -HUGE_VAL);
        return x;
      }
      default: {
        const Scalar x = earlier();
        const Scalar signed_x = flag() ? -x : x;
        return std::ldexp(signed_x, std::int8_t(byte()) / 4);
      }
    }
  }

  const std::uint8_t* data_;
  std::size_t rest_;
  std::array<Scalar, 16> earlier_{};
  std::size_t count_ = 0;
};

}  // namespace dyop::fuzz
