// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/interpolated_motion.h"

#include <gtest/gtest.h>

#include <numbers>

#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

constexpr RotationPath kPaths[] = {RotationPath::Slerp, RotationPath::RotationVector};

TEST(InterpolatedMotion, MeetsBothPoses) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const RigidPose begin = random.pose(10);
    const RigidPose end = random.pose(10);
    for (const RotationPath path : kPaths) {
      const InterpolatedMotion motion({2, 5}, begin, end, path);
      for (const auto& [t, X_WB] : {std::pair(2.0, begin), std::pair(5.0, end)}) {
        EXPECT_LT((motion.pose(t).translation() - X_WB.translation()).norm(), 1e-14);
        EXPECT_LT((motion.pose(t).rotation() - X_WB.rotation()).norm(), 1e-13);
      }
    }
  }
}

// A body that is driven one pose at a time: each motion starts where the last one was by then.
TEST(InterpolatedMotion, StaysARotationHoweverOftenItIsContinued) {
  Random random(5);
  RigidPose X_WB = random.pose(1);
  for (int k = 0; k < 20'000; ++k) {
    const RigidPose next(X_WB.rotation() * rotation_from_vector(Vector3(0.001, 0.002, 0.003)),
                         Vector3::Zero());
    X_WB = InterpolatedMotion({0, 1}, X_WB, next).pose(0.999);
    ASSERT_LT((X_WB.rotation().transpose() * X_WB.rotation() - Matrix3::Identity()).norm(), 1e-14);
  }
}

TEST(InterpolatedMotion, SlerpMatchesQuaternionSlerp) {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const RigidPose begin = random.pose(1);
    const RigidPose end = random.pose(1);
    const InterpolatedMotion motion({0, 1}, begin, end);
    const Scalar s = random.uniform(0, 1);
    const Matrix3 expected = begin.quaternion().slerp(s, end.quaternion()).toRotationMatrix();
    EXPECT_LT((motion.pose(s).rotation() - expected).norm(), 1e-12);
  }
}

TEST(InterpolatedMotion, RotationVectorPathIsLinearInTheVector) {
  const Vector3 r0(1, 0.2, -0.4);
  const Vector3 r1(-0.3, 2, 0.5);
  const InterpolatedMotion motion({0, 4}, RigidPose(rotation_from_vector(r0), Vector3::Zero()),
                                  RigidPose(rotation_from_vector(r1), Vector3::Zero()),
                                  RotationPath::RotationVector);
  const Matrix3 expected = rotation_from_vector(0.75 * r0 + 0.25 * r1);
  EXPECT_LT((motion.pose(1).rotation() - expected).norm(), 1e-14);
}

// About one axis both paths are the same constant turn: pi/2 in 2 time units.
TEST(InterpolatedMotion, BoundsAreEqualitiesForSlerp) {
  const RigidPose begin(Vector3(0, 0, 0));
  const RigidPose end(rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0)), Vector3(6, 0, 8));
  for (const RotationPath path : kPaths) {
    const TwistBound bound = InterpolatedMotion({0, 2}, begin, end, path).twist_bound({0, 1});
    EXPECT_NEAR(bound.linear_speed, 5, 1e-12);
    EXPECT_NEAR(bound.angular_speed, std::numbers::pi / 4, 1e-13);
    EXPECT_GE(bound.angular_speed, std::numbers::pi / 4);
    EXPECT_EQ(bound.linear_acceleration, 0);
    EXPECT_EQ(bound.angular_acceleration, 0);
  }
}

TEST(InterpolatedMotion, ChartTurnsMoreThanHalfATurn) {
  const InterpolatedMotion motion = InterpolatedMotion::from_chart(
      {0, 1}, Matrix3::Identity(), {Vector3::Zero(), Vector3::Zero()},
      {Vector3::Zero(), Vector3(0, 0, 9 * std::numbers::pi)});
  EXPECT_LT((motion.twist(0.3).w_WB - Vector3(0, 0, 9 * std::numbers::pi)).norm(), 1e-13);
  EXPECT_LT((motion.pose(1) * Vector3(1, 0, 0) - Vector3(-1, 0, 0)).norm(), 1e-14);
}

TEST(InterpolatedMotion, RefusesBadDomainsAndNumbers) {
  const RigidPose X;
  EXPECT_EQ(message_of([&] {
              InterpolatedMotion({2, 1}, X, X);
            }),
            "domain of interpolated motion must not be reversed: begin 2 > end 1");
  EXPECT_NE(message_of([&] {
              InterpolatedMotion({1, 1}, X, X);
            }).find("positive length"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              InterpolatedMotion({0, kInfinity}, X, X);
            }).find("finite"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              InterpolatedMotion::from_chart({0, 1}, Matrix3::Identity(), {},
                                             {Vector3::Zero(), Vector3(std::nan(""), 0, 0)});
            }).find("rotation vector at the end must be finite, not (nan"),
            std::string::npos);
  // Half a turn in so short a time that products of velocities overflow.
  EXPECT_EQ(message_of([&] {
              InterpolatedMotion::from_chart({0, 1e-200}, Matrix3::Identity(), {},
                                             {Vector3::Zero(), Vector3(1, 2, 0)});
            }),
            "interpolated motion over a time of 1e-200 is too fast: velocities overflow");
}

}  // namespace
}  // namespace dyop::testing
