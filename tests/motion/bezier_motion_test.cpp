// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/bezier_motion.h"

#include <gtest/gtest.h>

#include <vector>

#include "dyop/motion/interpolated_motion.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

const Matrix3 kIdentity = Matrix3::Identity();

TEST(BezierMotion, StartsAndEndsAtTheOuterControlPoints) {
  Random random(1);
  for (std::size_t count = 2; count <= BezierMotion::kMaxDegree + 1; ++count) {
    const Matrix3 R_WC = random.rotation();
    const std::vector<ControlPoint> points = random_points(random, count);
    const BezierMotion motion({-1, 4}, R_WC, points);
    for (const auto& [t, point] :
         {std::pair(-1.0, points.front()), std::pair(4.0, points.back())}) {
      EXPECT_LT((motion.pose(t).translation() - point.p_WB).norm(), 1e-14);
      EXPECT_LT((motion.pose(t).rotation() - R_WC * rotation_from_vector(point.theta)).norm(),
                1e-14);
    }
  }
}

// 1 - (1 - s)^2 has the coefficients 0, 1, 1: speed 2 (1 - s), acceleration -2, over a time of 2.
TEST(BezierMotion, AParabolaHasExactBounds) {
  const std::vector<ControlPoint> points = {{}, {Vector3::UnitX()}, {Vector3::UnitX()}};
  const BezierMotion motion({0, 2}, kIdentity, points);
  EXPECT_DOUBLE_EQ(motion.pose(1).translation().x(), 0.75);
  EXPECT_DOUBLE_EQ(motion.twist(0).v_WB.x(), 1);
  EXPECT_NEAR(motion.twist_bound({1, 2}).linear_speed, 0.5, 1e-13);
  EXPECT_NEAR(motion.twist_bound({1, 2}).linear_acceleration, 0.5, 1e-13);
  EXPECT_EQ(motion.twist_bound({1, 2}).angular_speed, 0);
}

// A line in position and rotation vector: no acceleration about a fixed axis, whatever the angle.
TEST(BezierMotion, DegreeOneIsAConstantTwistAboutAFixedAxis) {
  const std::vector<ControlPoint> points = {{}, {Vector3(3, 0, 0), Vector3(0, 0, 9)}};
  const BezierMotion motion({0, 3}, kIdentity, points);
  EXPECT_LT((motion.twist(1.7).w_WB - Vector3(0, 0, 3)).norm(), 1e-14);
  const TwistBound bound = motion.twist_bound({0, 3});
  EXPECT_NEAR(bound.linear_speed, 1, 1e-12);
  EXPECT_NEAR(bound.angular_speed, 3, 1e-12);
  EXPECT_LT(bound.linear_acceleration, 1e-12);
  EXPECT_LT(bound.angular_acceleration, 1e-12);
}

TEST(BezierMotion, ACubicIsTheHermiteMotionOfItsEnds) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Matrix3 R_WC = random.rotation();
    const std::vector<ControlPoint> b = random_points(random, 4);
    const Scalar h = 2;
    const BezierMotion bezier({1, 1 + h}, R_WC, b);
    const HermiteMotion hermite = HermiteMotion::from_chart(
        {1, 1 + h}, R_WC,
        {b[0].p_WB, 3 / h * (b[1].p_WB - b[0].p_WB), b[0].theta, 3 / h * (b[1].theta - b[0].theta)},
        {b[3].p_WB, 3 / h * (b[3].p_WB - b[2].p_WB), b[3].theta,
         3 / h * (b[3].theta - b[2].theta)});
    const Scalar t = random.uniform(1, 1 + h);
    EXPECT_LT((bezier.pose(t).translation() - hermite.pose(t).translation()).norm(), 1e-13);
    EXPECT_LT((bezier.pose(t).rotation() - hermite.pose(t).rotation()).norm(), 1e-13);
    EXPECT_LT((bezier.twist(t).w_WB - hermite.twist(t).w_WB).norm(), 1e-13);
    const TimeInterval part{t, random.uniform(t, 1 + h)};
    EXPECT_NEAR(bezier.twist_bound(part).angular_acceleration,
                hermite.twist_bound(part).angular_acceleration, 1e-11);
  }
}

// Degree nine, where the contract test's differences are not exact: the twist against central
// differences, error step^2/6 f''' < 2e-10 * 9*8*7 * 2^3 * 3 / 6 < 1e-6.
TEST(BezierMotion, BoundsHoldForTheHighestDegree) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const BezierMotion motion({0, 1}, random.rotation(),
                              random_points(random, BezierMotion::kMaxDegree + 1));
    const Scalar begin = random.uniform(0, 0.9);
    const TimeInterval part{begin, random.uniform(begin + 0.05, 1)};
    const TwistBound bound = motion.twist_bound(part);
    for (int k = 1; k < 40; ++k) {
      const Scalar step = 1e-5;
      const Scalar t = part.begin + part.length() * k / 40;
      const Twist twist = motion.twist(t);
      const Twist later = motion.twist(t + step);
      const Twist earlier = motion.twist(t - step);
      ASSERT_LE(twist.v_WB.norm(), bound.linear_speed);
      ASSERT_LE(twist.w_WB.norm(), bound.angular_speed);
      ASSERT_LE((later.v_WB - earlier.v_WB).norm() / (2 * step), bound.linear_acceleration + 1e-4);
      ASSERT_LE((later.w_WB - earlier.w_WB).norm() / (2 * step), bound.angular_acceleration + 1e-4);
      const Vector3 difference =
          (motion.pose(t + step).translation() - motion.pose(t - step).translation()) / (2 * step);
      ASSERT_LT((difference - twist.v_WB).norm(), 1e-6);
    }
  }
}

TEST(BezierMotion, RefusesBadInputNamingIt) {
  std::vector<ControlPoint> points(3);
  EXPECT_EQ(message_of([&] {
              BezierMotion({2, 2}, kIdentity, points);
            }),
            "domain of Bezier motion must have a positive, finite length, not [2, 2]");
  EXPECT_EQ(message_of([&] {
              BezierMotion({0, 1}, kIdentity, std::vector<ControlPoint>(1));
            }),
            "Bezier motion needs 2 to 10 control points, not 1");
  EXPECT_EQ(message_of([&] {
              BezierMotion({0, 1}, kIdentity, {});
            }),
            "Bezier motion needs 2 to 10 control points, not 0");
  EXPECT_EQ(message_of([&] {
              BezierMotion({0, 1}, kIdentity, std::vector<ControlPoint>(11));
            }),
            "Bezier motion needs 2 to 10 control points, not 11");
  points[1].theta.y() = std::nan("");
  EXPECT_NE(message_of([&] {
              BezierMotion({0, 1}, kIdentity, points);
            }).find("rotation vector of control point 1 must be finite"),
            std::string::npos);
  points[1] = {Vector3(1, 0, 0)};
  EXPECT_NE(message_of([&] {
              BezierMotion({0, 1e-300}, kIdentity, points);
            }).find("too fast"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              BezierMotion({0, 1}, 2 * kIdentity, points);
            }).find("orthonormal"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
