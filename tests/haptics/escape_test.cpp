// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "haptics/proxy.h"

namespace dyop::haptics_internal {
namespace {

TEST(Escape, FindsTheNearestWayOutOfABox) {
  Escape escape;
  escape.start(3, 0.1);
  EXPECT_TRUE(escape.is_for(3));
  EXPECT_FALSE(escape.is_for(2));
  int tried = 0;
  // Out is 1 along +y, and 3 or more along all others.
  while (!escape.direction() && !escape.has_failed() && tried < 10'000) {
    ++tried;
    escape.try_next([](const Vector3& moved) { return moved.y() > 1 || moved.norm() > 30; });
  }
  ASSERT_TRUE(escape.direction());
  EXPECT_EQ(*escape.direction(), Vector3::UnitY());
  EXPECT_LE(tried, Escape::kDirections * Escape::kLengths);
}

TEST(Escape, FailsWhereNothingLeadsOut) {
  Escape escape;
  escape.start(0, 1);
  int tried = 0;
  while (!escape.has_failed() && tried < 10'000) {
    ++tried;
    escape.try_next([](const Vector3&) { return false; });
  }
  EXPECT_EQ(tried, Escape::kDirections * Escape::kLengths);
  EXPECT_FALSE(escape.direction());
  escape.stop();
  EXPECT_FALSE(escape.is_for(0));
}

}  // namespace
}  // namespace dyop::haptics_internal
