// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "dyop/core/error.h"
#include "dyop/io/transform_stream.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

TEST(TransformMessage, ComesBackAsItWasSentToSinglePrecision) {
  std::mt19937_64 random(7);
  for (int k = 0; k < 100; ++k) {
    const TransformMessage message{"Device", testing::random_pose(300, random)};
    const auto read = unpack_transform(pack_transform(message));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->name, "Device");
    EXPECT_TRUE(read->pose.translation().isApprox(message.pose.translation(), 1e-6));
    EXPECT_TRUE(read->pose.rotation().isApprox(message.pose.rotation(), 1e-6));
  }
}

// The header by hand, from the protocol's description.
TEST(TransformMessage, HasTheLayoutOfTheProtocol) {
  const auto bytes = pack_transform({"Tool", RigidPose(Vector3(1, 2, 4))});
  ASSERT_EQ(bytes.size(), 106u);
  EXPECT_EQ(bytes[1], 1);
  EXPECT_EQ(std::string(bytes.begin() + 2, bytes.begin() + 11), "TRANSFORM");
  EXPECT_EQ(std::string(bytes.begin() + 14, bytes.begin() + 18), "Tool");
  EXPECT_EQ(bytes[49], 48);
  // The first entry of the matrix, 1.0f, and the last of the position, 4.0f.
  EXPECT_EQ(bytes[58], 0x3f);
  EXPECT_EQ(bytes[59], 0x80);
  EXPECT_EQ(bytes[102], 0x40);
  EXPECT_EQ(bytes[103], 0x80);
}

TEST(TransformMessage, RefusesWhatIsNone) {
  const auto bytes = pack_transform({"Tool", RigidPose(Vector3(1, 2, 4))});
  for (std::size_t k : {std::size_t{1}, std::size_t{3}, std::size_t{49}, std::size_t{52},
                        std::size_t{60}, std::size_t{105}}) {
    auto damaged = bytes;
    damaged[k] ^= 0x10;
    EXPECT_FALSE(unpack_transform(damaged)) << k;
  }
  EXPECT_FALSE(unpack_transform(std::span(bytes).first(50)));
  EXPECT_FALSE(unpack_transform({}));
  EXPECT_THROW(pack_transform({"a name of more than twenty bytes", {}}), InvalidArgument);
}

// A message of version 2: an extended header before the matrix, metadata after it.
std::vector<std::uint8_t> extended_message(const TransformMessage& message) {
  const std::vector<std::uint8_t> plain = pack_transform(message);
  std::vector<std::uint8_t> bytes(plain.begin(), plain.begin() + 58);
  const std::vector<std::uint8_t> extended{0, 14, 0, 2, 0, 0, 0, 3, 0, 0, 0, 9, 7, 7};
  bytes.insert(bytes.end(), extended.begin(), extended.end());
  bytes.insert(bytes.end(), plain.begin() + 58, plain.end());
  bytes.insert(bytes.end(), {1, 2, 3, 4, 5});
  bytes[1] = 2;
  bytes[49] = std::uint8_t(bytes.size() - 58);
  std::uint64_t sum = 0;  // CRC-64 of ECMA-182, from its definition as a division of polynomials
  for (std::size_t k = 8 * 58; k < 8 * (bytes.size() + 8); ++k) {
    const bool out = (sum >> 63) != 0;
    const bool in = k < 8 * bytes.size() && ((bytes[k / 8] >> (7 - k % 8)) & 1) != 0;
    sum = (sum << 1) ^ std::uint64_t{in} ^ (out ? 0x42F0E1EBA9EA3693u : 0u);
  }
  for (int k = 0; k < 8; ++k) bytes[std::size_t(50 + k)] = std::uint8_t(sum >> (56 - 8 * k));
  return bytes;
}

TEST(TransformMessage, ReadsAnExtendedHeaderAndMetadata) {
  const RigidPose X(Vector3(1, 2, 4));
  const auto bytes = extended_message({"Stylus", X});
  const auto message = unpack_transform(bytes);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->name, "Stylus");
  EXPECT_EQ(message->pose.translation(), X.translation());
  auto damaged = bytes;
  damaged[59] = 200;  // an extended header longer than the body
  EXPECT_FALSE(unpack_transform(damaged));
}

class TransformReading : public ::testing::Test {
 protected:
  // In pieces of random length; the positions of the messages that came out.
  std::vector<Scalar> read(const std::vector<std::uint8_t>& bytes, std::size_t longest_piece) {
    std::vector<Scalar> positions;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t length =
          std::min(bytes.size() - at, 1 + std::size_t(random_() % longest_piece));
      EXPECT_TRUE(reader_.add(std::span(bytes).subspan(at, length)));
      if (const auto message = reader_.take()) {
        positions.push_back(message->pose.translation().x());
      }
      at += length;
    }
    return positions;
  }

  // A message of another type, filled with noise.
  std::vector<std::uint8_t> other_message(std::uint16_t length) {
    std::vector<std::uint8_t> bytes(58 + std::size_t(length));
    for (std::uint8_t& byte : bytes) byte = std::uint8_t(random_());
    const std::string head("\0\1STATUS\0\0\0\0\0\0", 14);
    std::copy(head.begin(), head.end(), bytes.begin());
    std::fill_n(bytes.begin() + 42, 6, std::uint8_t{0});
    bytes[48] = std::uint8_t(length >> 8);
    bytes[49] = std::uint8_t(length);
    return bytes;
  }

  std::mt19937_64 random_{5};
  TransformReader reader_;
};

TEST_F(TransformReading, FindsEveryTransformInAStreamCutAnywhere) {
  std::vector<std::uint8_t> stream;
  std::vector<Scalar> sent;
  const auto append = [&](const std::vector<std::uint8_t>& bytes) {
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  };
  for (int k = 0; k < 400; ++k) {
    const TransformMessage message{"Device", RigidPose(Vector3(k, 0, 0))};
    append(k % 3 == 0 ? extended_message(message) : pack_transform(message));
    sent.push_back(k);
    if (k % 2 == 0) append(other_message(std::uint16_t(random_() % 700)));
    if (k % 5 == 0) append(other_message(0));
  }
  // No piece holds two messages, so that none is dropped for a newer one.
  EXPECT_EQ(read(stream, 90), sent);
}

TEST_F(TransformReading, PassesOverADamagedMessage) {
  auto damaged = pack_transform({"Device", RigidPose(Vector3(1, 0, 0))});
  damaged[70] ^= 1;
  EXPECT_TRUE(reader_.add(damaged));
  EXPECT_FALSE(reader_.take());
  EXPECT_TRUE(reader_.add(pack_transform({"Device", RigidPose(Vector3(2, 0, 0))})));
  EXPECT_TRUE(reader_.take());
}

TEST_F(TransformReading, SaysWhenTheStreamIsAnotherProtocol) {
  const std::string web =
      "GET / HTTP/1.1\r\nHost: localhost\r\nAccept: text/html,application/xml\r\n";
  const std::vector<std::uint8_t> bytes(web.begin(), web.end());
  EXPECT_FALSE(reader_.add(bytes));
  EXPECT_FALSE(reader_.add(pack_transform({"Device", RigidPose()})));
  EXPECT_FALSE(reader_.take());
}

}  // namespace
}  // namespace dyop
