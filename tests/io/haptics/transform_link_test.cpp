// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/io/transform_stream.h"

namespace dyop {
namespace {

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

TEST(TransformLink, HearsOnePeer) {
  TransformLink receiver(0);
  TransformLink device(0);
  TransformLink stranger(0);
  const auto send = [&](TransformLink& from, Scalar x) {
    ASSERT_TRUE(from.send("127.0.0.1", receiver.port(), {"Device", RigidPose(Vector3(x, 0, 0))}));
  };
  send(device, 1);
  ASSERT_TRUE(receiver.receive());
  send(device, 2);
  send(stranger, 3);
  const auto message = receiver.receive();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->pose.translation().x(), 2);
  send(stranger, 4);
  EXPECT_FALSE(receiver.receive());
}

TEST(TransformLink, ListensOnLoopbackUnlessItIsToldOtherwise) {
  TransformLink sender(0);
  TransformLink receiver(0);
  TransformLink everywhere(0, "0.0.0.0");
  const TransformMessage message{"Device", RigidPose()};
  sender.send("127.0.0.2", receiver.port(), message);
  EXPECT_FALSE(receiver.receive());
  sender.send("127.0.0.2", everywhere.port(), message);
  EXPECT_TRUE(everywhere.receive());
  EXPECT_THROW(TransformLink(0, "localhost"), InvalidArgument);
}

}  // namespace
}  // namespace dyop
