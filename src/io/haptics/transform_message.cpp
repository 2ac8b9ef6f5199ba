// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_message.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "dyop/core/error.h"

namespace dyop {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kHeader = 58;
constexpr std::size_t kContent = 48;
constexpr std::size_t kTypeAt = 2, kTypeLength = 12;
constexpr std::size_t kNameAt = 14, kNameLength = 20;
constexpr std::size_t kSizeAt = 42;
constexpr std::size_t kSumAt = 50;
constexpr std::string_view kType = "TRANSFORM";

// Of headers that we read. From version 2 on a body may start with an extended header, whose first
// number is its own length, and end with metadata.
constexpr std::uint16_t kLastVersion = 3;
constexpr std::size_t kLeastExtended = 12;

// Longer messages are passed over: no transform has so much metadata.
constexpr std::uint64_t kLongestBody = 1 << 12;

// Longer than any volume sent as an image: not a length but noise.
constexpr std::uint64_t kLongestPassedOver = std::uint64_t{1} << 32;

// Matrices in single precision after a few products, or written with four decimals; what is farther
// off is scaled, or not meant as a rotation.
constexpr Scalar kRotationNoise = 1e-3;  // literal: of R^T R - 1

// CRC-64 of ECMA-182, most significant bit first.
std::uint64_t check_sum(Bytes bytes) {
  constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;
  std::uint64_t sum = 0;
  for (const std::uint8_t byte : bytes) {
    sum ^= std::uint64_t{byte} << 56;
    for (int bit = 0; bit < 8; ++bit) sum = (sum << 1) ^ ((sum >> 63) != 0 ? kPolynomial : 0);
  }
  return sum;
}

// Numbers are big-endian.
template <typename Unsigned>
void put(std::vector<std::uint8_t>& bytes, std::size_t at, Unsigned number) {
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    bytes[at + k] = std::uint8_t(number >> (8 * (sizeof(Unsigned) - 1 - k)));
  }
}

template <typename Unsigned>
Unsigned read(Bytes bytes, std::size_t at) {
  Unsigned number = 0;
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    number = Unsigned(number << 8) | Unsigned(bytes[at + k]);
  }
  return number;
}

std::string read_text(Bytes bytes, std::size_t at, std::size_t length) {
  std::string text;
  for (std::size_t k = 0; k < length && bytes[at + k] != 0; ++k) text += char(bytes[at + k]);
  return text;
}

// Whether a header's type is text, as in every message.
bool is_printable(Bytes header) {
  const std::string type = read_text(header, kTypeAt, kTypeLength);
  return !type.empty() &&
         std::all_of(type.begin(), type.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

// The matrix within a message of this type.
std::optional<Bytes> content_of(Bytes bytes) {
  const auto version = read<std::uint16_t>(bytes, 0);
  const Bytes body = bytes.subspan(kHeader);
  if (version < 1 || version > kLastVersion) return std::nullopt;
  if (body.size() == kContent) return body;
  const auto extended = std::size_t(read<std::uint16_t>(body, 0));
  if (version == 1 || extended < kLeastExtended || body.size() < extended + kContent) {
    return std::nullopt;
  }
  return body.subspan(extended, kContent);
}

// The nearest rotation, if the matrix is within the noise of one.
std::optional<Matrix3> rotation_near(const Matrix3& R) {
  if (!R.allFinite()) return std::nullopt;
  const Scalar error = (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kRotationNoise) || !(R.determinant() > 0)) return std::nullopt;
  return Quaternion(R).normalized().toRotationMatrix();
}

}  // namespace

std::vector<std::uint8_t> pack_transform(const TransformMessage& message) {
  DYOP_REQUIRE(message.name.size() <= kNameLength, "a transform's name has at most 20 bytes, not ",
               message.name.size());
  std::vector<std::uint8_t> bytes(kHeader + kContent);
  put(bytes, 0, std::uint16_t{1});
  std::copy(kType.begin(), kType.end(), bytes.begin() + kTypeAt);
  std::copy(message.name.begin(), message.name.end(), bytes.begin() + kNameAt);
  put(bytes, kSizeAt, std::uint64_t{kContent});
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      const Scalar entry =
          column < 3 ? message.pose.rotation()(row, column) : message.pose.translation()[row];
      const auto place = kHeader + 4 * std::size_t(3 * column + row);
      put(bytes, place, std::bit_cast<std::uint32_t>(float(entry)));
    }
  }
  put(bytes, kSumAt, check_sum(Bytes(bytes).subspan(kHeader)));
  return bytes;
}

std::optional<TransformMessage> unpack_transform(Bytes bytes) {
  if (bytes.size() < kHeader + kContent || read_text(bytes, kTypeAt, kTypeLength) != kType ||
      read<std::uint64_t>(bytes, kSizeAt) != bytes.size() - kHeader ||
      read<std::uint64_t>(bytes, kSumAt) != check_sum(bytes.subspan(kHeader))) {
    return std::nullopt;
  }
  const std::optional<Bytes> content = content_of(bytes);
  if (!content) return std::nullopt;
  std::array<Scalar, 12> numbers;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    numbers[k] = Scalar(std::bit_cast<float>(read<std::uint32_t>(*content, 4 * k)));
  }
  const std::optional<Matrix3> R = rotation_near(Eigen::Map<const Matrix3>(numbers.data()));
  const Vector3 p(numbers[9], numbers[10], numbers[11]);
  if (!R || !p.allFinite()) return std::nullopt;
  return TransformMessage{read_text(bytes, kNameAt, kNameLength), RigidPose(*R, p)};
}

bool TransformReader::add(Bytes bytes) {
  while (!bytes.empty() && !is_lost_) {
    const bool is_in_header = message_.size() < kHeader;
    const std::uint64_t wanted = is_in_header ? kHeader - message_.size() : missing_;
    const Bytes piece = bytes.first(std::size_t(std::min<std::uint64_t>(wanted, bytes.size())));
    bytes = bytes.subspan(piece.size());
    if (is_in_header || is_kept_) message_.insert(message_.end(), piece.begin(), piece.end());
    if (is_in_header) {
      if (message_.size() < kHeader) break;
      is_lost_ = !end_header();
    } else {
      missing_ -= piece.size();
    }
    if (missing_ > 0 || is_lost_) continue;
    if (is_kept_) {
      if (auto message = unpack_transform(message_)) newest_ = std::move(message);
    }
    message_.clear();
  }
  return !is_lost_;
}

// Whether the header reads as one.
bool TransformReader::end_header() {
  const auto version = read<std::uint16_t>(message_, 0);
  missing_ = read<std::uint64_t>(message_, kSizeAt);
  is_kept_ = read_text(message_, kTypeAt, kTypeLength) == kType && missing_ <= kLongestBody;
  return version >= 1 && version <= kLastVersion && missing_ <= kLongestPassedOver &&
         is_printable(message_);
}

std::optional<TransformMessage> TransformReader::take() {
  return std::exchange(newest_, std::nullopt);
}

}  // namespace dyop
