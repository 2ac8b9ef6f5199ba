// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numbers>

#include "dyop/motion/steady_motions.h"
#include "motion/motion_test_tools.h"
#include "motion/random_values.h"

namespace dyop::testing {
namespace {

// A quarter turn per unit time about z while moving along x: at t0 + 1 the body's x axis points
// along y, and the origin is at x = 3.
TEST(ConstantTwistMotion, TurnsAboutItsMovingOrigin) {
  const ConstantTwistMotion motion(RigidPose(Vector3(1, 0, 0)),
                                   {Vector3(2, 0, 0), Vector3(0, 0, std::numbers::pi / 2)}, 10);
  const Vector3 p_W = motion.pose(11) * Vector3(1, 0, 0);
  EXPECT_LT((p_W - Vector3(3, 1, 0)).norm(), 1e-15);
  EXPECT_EQ(motion.pose(10).translation(), Vector3(1, 0, 0));
}

// The angular velocity is constant in the world, also if the body starts turned.
TEST(ConstantTwistMotion, TakesTheAngularVelocityInWorld) {
  const Matrix3 R_WB0 = rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0));
  const ConstantTwistMotion motion(RigidPose(R_WB0, Vector3::Zero()),
                                   {Vector3::Zero(), Vector3(0, 0, std::numbers::pi)});
  // The body's x axis points along -z of the world: on the axis of turning, so it stays.
  EXPECT_LT((motion.pose(1) * Vector3(1, 0, 0) - Vector3(0, 0, -1)).norm(), 1e-15);
}

// As a recording does it. Every product of two rotations has drifted a little.
TEST(ConstantTwistMotion, KeepsItsBitsWhenItIsBuiltAgain) {
  Random random(5);
  int restored = 0;
  for (int k = 0; k < 100000; ++k) {
    const RigidPose X_WB0 = random.pose(1) * random.pose(1) * random.pose(1);
    const Twist twist{random.in_ball(1), random.in_ball(1)};
    const ConstantTwistMotion motion(X_WB0, twist);
    const ConstantTwistMotion again(motion.X_WB0(), twist);
    ASSERT_EQ(again.pose(0.5).rotation(), motion.pose(0.5).rotation()) << k;
    ASSERT_EQ(again.X_WB0().rotation(), motion.X_WB0().rotation()) << k;
    ASSERT_TRUE(motion.X_WB0().rotation().isApprox(X_WB0.rotation(), 1e-14)) << k;
    restored += motion.X_WB0().rotation() != X_WB0.rotation();
  }
  EXPECT_GT(restored, 1000);
}

TEST(ConstantTwistMotion, BoundsAreEqualitiesUpToRounding) {
  const ConstantTwistMotion motion(RigidPose(), {Vector3(3, 4, 0), Vector3(0, 5, 12)});
  const TwistBound bound = motion.twist_bound({-5, 1e6});
  EXPECT_GE(bound.linear_speed, 5);
  EXPECT_LT(bound.linear_speed, 5 * (1 + 1e-13));
  EXPECT_GE(bound.angular_speed, 13);
  EXPECT_LT(bound.angular_speed, 13 * (1 + 1e-13));
  EXPECT_EQ(bound.linear_acceleration, 0);
  EXPECT_EQ(bound.angular_acceleration, 0);
}

TEST(ConstantTwistMotion, RefusesNumbersThatAreNotFinite) {
  const Vector3 zero = Vector3::Zero();
  EXPECT_EQ(message_of([&] {
              ConstantTwistMotion(RigidPose(), {Vector3(0, kInfinity, 0), zero});
            }),
            "velocity must be finite, not (0 inf 0)");
  EXPECT_NE(message_of([&] {
              ConstantTwistMotion(RigidPose(), {zero, Vector3(0, std::nan(""), 0)});
            }).find("angular velocity must be finite"),
            std::string::npos);
  EXPECT_EQ(message_of([&] {
              ConstantTwistMotion(RigidPose(), {zero, zero}, kInfinity);
            }),
            "reference time must be finite, not inf");
  EXPECT_NE(message_of([&] {
              ConstantTwistMotion(RigidPose(), {zero, Vector3(1.5e308, 1.5e308, 0)});
            }).find("its length overflows"),
            std::string::npos);
}

// The squares of these parts are below the smallest number.
TEST(ConstantTwistMotion, BoundsSpeedsWhoseSquaresUnderflow) {
  const Scalar v = 3.7349e-161;
  const ConstantTwistMotion motion(RigidPose(), {Vector3(0, 0, -v), Vector3(v / 1e6, 0, 0)});
  const TwistBound bound = motion.twist_bound({0, 1});
  EXPECT_GE(bound.linear_speed, v);
  EXPECT_GE(bound.angular_speed, v / 1e6);
  EXPECT_LE(bound.linear_speed, v * (1 + 1e-12));
}

}  // namespace
}  // namespace dyop::testing
