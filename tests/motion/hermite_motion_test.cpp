// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <numbers>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

const Vector3 kZero = Vector3::Zero();

Twist random_twist(Random& random) {
  return {random.in_ball(5), random.in_ball(3)};
}

TEST(HermiteMotion, MeetsPosesAndTwistsAtBothEnds) {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    const MotionState begin{random.pose(10), random_twist(random)};
    const MotionState end{random.pose(10), random_twist(random)};
    const HermiteMotion motion({-1, 2}, begin, end);
    for (const auto& [t, state] : {std::pair(-1.0, begin), std::pair(2.0, end)}) {
      const RigidPose X_WB = motion.pose(t);
      EXPECT_LT((X_WB.translation() - state.X_WB.translation()).norm(), 1e-13);
      EXPECT_LT((X_WB.rotation() - state.X_WB.rotation()).norm(), 1e-13);
      EXPECT_LT((motion.twist(t).v_WB - state.twist.v_WB).norm(), 1e-13);
      EXPECT_LT((motion.twist(t).w_WB - state.twist.w_WB).norm(), 1e-13);
    }
  }
}

TEST(HermiteMotion, PoseIsThatOfTheStateToTheBit) {
  Random random(9);
  const HermiteMotion motion({0, 1}, {random.pose(10), random_twist(random)},
                             {random.pose(10), random_twist(random)});
  for (int i = 0; i <= 64; ++i) {
    const RigidPose X_WB = motion.pose(i / 64.0);
    const RigidPose of_state = motion.state(i / 64.0).X_WB;
    EXPECT_EQ(X_WB.translation(), of_state.translation());
    EXPECT_EQ(X_WB.rotation(), of_state.rotation());
  }
}

// Free fall is a quadratic, which a cubic reproduces: z = 7 t - 5 t^2.
TEST(HermiteMotion, ReproducesFreeFallWithTightBounds) {
  const HermiteMotion motion({0, 2}, {RigidPose(), {Vector3(0, 0, 7), kZero}},
                             {RigidPose(Vector3(0, 0, -6)), {Vector3(0, 0, -13), kZero}});
  EXPECT_NEAR(motion.pose(0.5).translation().z(), 3.5 - 1.25, 1e-14);
  EXPECT_NEAR(motion.twist_bound({0, 0.5}).linear_speed, 7, 1e-12);
  EXPECT_NEAR(motion.twist_bound({1, 1.5}).linear_speed, 8, 1e-12);
  EXPECT_NEAR(motion.twist_bound({0, 2}).linear_acceleration, 10, 1e-11);
  EXPECT_EQ(motion.twist_bound({0, 2}).angular_speed, 0);
}

// A constant turn is linear in theta: no angular acceleration, whatever the angle.
TEST(HermiteMotion, ReproducesAConstantTwistWithTightBounds) {
  Random random(2);
  const Twist twist{random.in_ball(3), Vector3(0.4, -1.1, 0.7)};
  const ConstantTwistMotion exact(random.pose(4), twist);
  const HermiteMotion motion({0, 2}, {exact.pose(0), twist}, {exact.pose(2), twist});
  EXPECT_LT((motion.pose(1.3).rotation() - exact.pose(1.3).rotation()).norm(), 1e-14);
  EXPECT_LT((motion.pose(1.3).translation() - exact.pose(1.3).translation()).norm(), 1e-14);
  const TwistBound bound = motion.twist_bound({0.3, 1.7});
  EXPECT_NEAR(bound.linear_speed, twist.v_WB.norm(), 1e-12);
  EXPECT_NEAR(bound.angular_speed, twist.w_WB.norm(), 1e-12);
  EXPECT_LT(bound.linear_acceleration, 1e-12);
  EXPECT_LT(bound.angular_acceleration, 1e-12);
}

TEST(HermiteMotion, ChartTurnsMoreThanHalfATurn) {
  const Vector3 full(0, 0, 3 * std::numbers::pi);
  const HermiteMotion motion = HermiteMotion::from_chart(
      {0, 1}, Matrix3::Identity(), {kZero, kZero, kZero, full}, {kZero, kZero, full, full});
  EXPECT_LT((motion.twist(0.4).w_WB - full).norm(), 1e-14);
  EXPECT_LT((motion.pose(1) * Vector3(1, 0, 0) - Vector3(-1, 0, 0)).norm(), 1e-14);
}

TEST(HermiteMotion, ChartAndStatesGiveTheSameMotion) {
  Random random(3);
  const MotionState begin{random.pose(1), random_twist(random)};
  const Vector3 theta(0.3, -0.8, 0.5);
  const Vector3 theta_rate(1, 0.2, -0.6);
  const Vector3 p_WB1 = random.in_ball(1), v_WB1 = random.in_ball(1);
  const Matrix3& R_WC = begin.X_WB.rotation();
  const HermiteMotion chart = HermiteMotion::from_chart(
      {0, 1}, R_WC,
      {begin.X_WB.translation(), begin.twist.v_WB, kZero, R_WC.transpose() * begin.twist.w_WB},
      {p_WB1, v_WB1, theta, theta_rate});
  const HermiteMotion states({0, 1}, begin, {chart.pose(1), chart.twist(1)});
  for (const Scalar t : {0.0, 0.21, 0.77, 1.0}) {
    EXPECT_LT((chart.pose(t).rotation() - states.pose(t).rotation()).norm(), 1e-14);
    EXPECT_LT((chart.twist(t).w_WB - states.twist(t).w_WB).norm(), 1e-13);
  }
}

// Near the start theta vanishes, and all bounds of short parts tend to the values there: linearly
// in the length of the part.
TEST(HermiteMotion, BoundsOfShortPartsConvergeToTheValues) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    const HermiteMotion motion({0, 1}, {random.pose(10), random_twist(random)},
                               {random.pose(10), random_twist(random)});
    const Scalar length = 1e-5;
    const TwistBound bound = motion.twist_bound({0, length});
    const Twist twist = motion.twist(0);
    const auto rate = [&](auto member) {
      const auto f = [&](Scalar t) { return Vector3(motion.twist(t).*member); };
      return differentiate(f, 3.0 / 1024, 1.0 / 1024).norm();
    };
    EXPECT_NEAR(bound.linear_speed, twist.v_WB.norm(), 100 * length);
    EXPECT_NEAR(bound.angular_speed, twist.w_WB.norm(), 100 * length);
    // The derivative is taken 3/1024 away; jerks are below about 400.
    EXPECT_NEAR(bound.linear_acceleration, rate(&Twist::v_WB), 1.5);
    EXPECT_NEAR(bound.angular_acceleration, rate(&Twist::w_WB), 1.5);
  }
}

// An integrator-like step of unit speed that turns by half a radian, with an end velocity off by d,
// |d| <= 0.2: the coefficients of the rate are v, v - d and v + d, so the bound is at most 1.2
// times the speed at the start. The same holds for the turn with |d| <= 0.1 of 0.5, except that
// theta' differs from the angular velocity by a factor of up to (f/2) / sin(f/2) < 1.02, f < 0.6.
TEST(HermiteMotion, WholeBoundsAreTightForModerateSteps) {
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const Twist begin{random.direction(), 0.5 * random.direction()};
    const ConstantTwistMotion steady(random.pose(1), begin);
    const Twist end{begin.v_WB + random.in_ball(0.2), begin.w_WB + random.in_ball(0.1)};
    const TwistBound bound =
        HermiteMotion({0, 1}, {steady.pose(0), begin}, {steady.pose(1), end}).twist_bound({0, 1});
    EXPECT_LT(bound.linear_speed, 1.2 + 1e-12);
    EXPECT_LT(bound.angular_speed, 0.5 * 1.2 * 1.02);
  }
}

// Positions of size 1e9 with displacements of size 1: velocities keep ten digits and more.
TEST(HermiteMotion, StaysAccurateFarFromTheOrigin) {
  const Vector3 far(1e9, -1e9, 1e9);
  const Vector3 v(1, 2, 3);
  const HermiteMotion motion({1e6, 1e6 + 1}, {RigidPose(far), {v, kZero}},
                             {RigidPose(Vector3(far + v)), {v, kZero}});
  EXPECT_LT((motion.twist(1e6 + 0.3).v_WB - v).norm(), 1e-14);
  EXPECT_LT(motion.twist_bound({1e6, 1e6 + 1}).linear_acceleration, 1e-12);
}

TEST(HermiteMotion, RefusesBadInputNamingIt) {
  const MotionState state{RigidPose(), {kZero, kZero}};
  EXPECT_EQ(message_of([&] {
              HermiteMotion({3, 2}, state, state);
            }),
            "domain of Hermite motion must not be reversed: begin 3 > end 2");
  EXPECT_EQ(message_of([&] {
              HermiteMotion({2, 2}, state, state);
            }),
            "domain of Hermite motion must have a positive, finite length, not [2, 2]");
  MotionState wrong = state;
  wrong.twist.w_WB.y() = std::nan("");
  EXPECT_NE(message_of([&] {
              HermiteMotion({0, 1}, state, wrong);
            }).find("angular velocity at the end"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              HermiteMotion::from_chart({0, 1}, Matrix3::Identity(), {},
                                        {kZero, kZero, Vector3(0, kInfinity, 0), kZero});
            }).find("rotation vector at the end must be finite"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              HermiteMotion::from_chart({0, 1}, 2 * Matrix3::Identity(), {}, {});
            }).find("orthonormal"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              HermiteMotion({0, 1e-300}, state, {RigidPose(Vector3(1, 0, 0)), {kZero, kZero}});
            }).find("too fast"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
