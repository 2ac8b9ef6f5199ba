// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tool_io/transform_link.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/core/error.h"
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

TEST(TransformLink, TheNewestMessageArrives) {
  TransformLink receiver(0);
  TransformLink sender(0);
  EXPECT_FALSE(receiver.receive());
  for (int k = 0; k < 5; ++k) {
    const TransformMessage message{"Device", RigidPose(Vector3(k, 0, 0))};
    ASSERT_TRUE(sender.send("127.0.0.1", receiver.port(), message));
  }
  const auto message = receiver.receive();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->pose.translation().x(), 4);
  EXPECT_FALSE(receiver.receive());
  EXPECT_THROW(sender.send("nowhere", 1, *message), InvalidArgument);
}

}  // namespace
}  // namespace dyop
