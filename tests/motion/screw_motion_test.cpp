// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numbers>

#include "dyop/motion/steady_motions.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

// A door hinged on the z axis through (1, 0, 0), opened by a quarter turn: its far edge goes from
// (3, 0, 0) to (1, 2, 0), and lifts by 0.5.
TEST(ScrewMotion, TurnsAboutItsAxisAndSlidesAlongIt) {
  const ScrewMotion door(RigidPose(Vector3(3, 0, 0)),
                         {Vector3(1, 0, 7), Vector3(0, 0, 4), std::numbers::pi / 2, 0.5});
  EXPECT_LT((door.pose(1).translation() - Vector3(1, 2, 0.5)).norm(), 1e-15);
  EXPECT_LT((door.pose(1).rotation() * Vector3::UnitX() - Vector3::UnitY()).norm(), 1e-15);
}

TEST(ScrewMotion, StaysARotationHoweverOftenItIsContinued) {
  RigidPose X_WB;
  for (int k = 0; k < 20'000; ++k) {
    X_WB = ScrewMotion(X_WB, {Vector3(1, 0, 0), Vector3(0.6, 0, 0.8), 0.1, 0}).pose(0.1);
    ASSERT_LT((X_WB.rotation().transpose() * X_WB.rotation() - Matrix3::Identity()).norm(), 1e-14);
  }
}

// rho = 2, turn 3, slide 8: speed sqrt(36 + 64) = 10, acceleration 9 * 2.
TEST(ScrewMotion, BoundsAreEqualitiesUpToRounding) {
  const ScrewMotion motion(RigidPose(Vector3(0, 2, 0)), {Vector3::Zero(), Vector3::UnitX(), 3, 8});
  const TwistBound bound = motion.twist_bound({0, 1});
  EXPECT_NEAR(bound.linear_speed, 10, 1e-12);
  EXPECT_GE(bound.linear_speed, 10);
  EXPECT_NEAR(bound.angular_speed, 3, 1e-12);
  EXPECT_NEAR(bound.linear_acceleration, 18, 1e-12);
  EXPECT_EQ(bound.angular_acceleration, 0);
}

TEST(ScrewMotion, RefusesAZeroAxisAndNumbersThatAreNotFinite) {
  EXPECT_EQ(message_of([] {
              ScrewMotion(RigidPose(), {Vector3::Zero(), Vector3::Zero(), 1, 1});
            }),
            "direction of the screw axis must not be zero");
  EXPECT_EQ(message_of([] {
              ScrewMotion(RigidPose(), {Vector3::Zero(), Vector3::UnitX(), kInfinity, 1});
            }),
            "turn rate must be finite, not inf");
}

}  // namespace
}  // namespace dyop::testing
