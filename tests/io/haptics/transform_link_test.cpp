// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_link.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"

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

}  // namespace
}  // namespace dyop
