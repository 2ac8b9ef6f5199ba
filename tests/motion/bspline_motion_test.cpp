// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "dyop/motion/bezier_motion.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

// The basis function of the control point i by its recursion (Cox, de Boor), 0/0 being 0.
Scalar basis(const std::vector<Scalar>& knots, std::size_t i, std::size_t degree, Scalar t) {
  if (degree == 0) return knots[i] <= t && t < knots[i + 1] ? 1 : 0;
  const auto ratio = [](Scalar x, Scalar y) { return y == 0 ? 0 : x / y; };
  return ratio(t - knots[i], knots[i + degree] - knots[i]) * basis(knots, i, degree - 1, t) +
         ratio(knots[i + degree + 1] - t, knots[i + degree + 1] - knots[i + 1]) *
             basis(knots, i + 1, degree - 1, t);
}

TEST(BsplineMotion, IsTheSumOfTheBasisFunctions) {
  Random random(1);
  for (std::size_t degree = 1; degree <= BezierMotion::kMaxDegree; ++degree) {
    for (int trial = 0; trial < 20; ++trial) {
      const std::size_t count = degree + 1 + static_cast<std::size_t>(trial % 7);
      std::vector<Scalar> knots{random.uniform(-1, 1)};
      while (knots.size() < count + degree + 1) {
        // Every third knot is there twice, where the degree allows.
        const bool is_double = degree > 1 && knots.size() % 3 == 0;
        knots.push_back(knots.back() + (is_double ? 0 : random.uniform(0.1, 1)));
      }
      if (knots[degree] == knots[count]) continue;
      const std::vector<ControlPoint> points = random_points(random, count);
      const Matrix3 R_WC = random.rotation();
      const SequenceMotion motion = bspline_motion(degree, knots, R_WC, points);
      EXPECT_EQ(motion.domain(), (TimeInterval{knots[degree], knots[count]}));
      for (int k = 0; k < 50; ++k) {
        const Scalar t = knots[degree] + (knots[count] - knots[degree]) * k / 50;
        Vector3 p_WB = Vector3::Zero(), theta = Vector3::Zero();
        for (std::size_t i = 0; i < count; ++i) {
          p_WB += basis(knots, i, degree, t) * points[i].p_WB;
          theta += basis(knots, i, degree, t) * points[i].theta;
        }
        ASSERT_LT((motion.pose(t).translation() - p_WB).norm(), 1e-13);
        ASSERT_LT((motion.pose(t).rotation() - R_WC * rotation_from_vector(theta)).norm(), 1e-13);
      }
    }
  }
}

TEST(BsplineMotion, WithoutInnerKnotsItIsABezierCurve) {
  Random random(2);
  const std::vector<ControlPoint> points = random_points(random, 4);
  const std::vector<Scalar> knots = {1, 1, 1, 1, 3, 3, 3, 3};
  const SequenceMotion spline = bspline_motion(3, knots, Matrix3::Identity(), points);
  const BezierMotion bezier({1, 3}, Matrix3::Identity(), points);
  for (const Scalar t : {1.0, 1.4, 2.9, 3.0}) {
    EXPECT_LT((spline.pose(t).translation() - bezier.pose(t).translation()).norm(), 1e-14);
    EXPECT_LT((spline.twist(t).w_WB - bezier.twist(t).w_WB).norm(), 1e-14);
  }
}

TEST(BsplineMotion, TwistIsContinuousAcrossASimpleKnot) {
  Random random(3);
  const std::vector<Scalar> knots = {0, 0, 0, 0, 0.3, 0.7, 1, 1, 1, 1};
  const SequenceMotion motion =
      bspline_motion(3, knots, Matrix3::Identity(), random_points(random, 6));
  for (const Scalar t : {0.3, 0.7}) {
    const Scalar before = std::nextafter(t, 0);
    EXPECT_LT((motion.twist(t).v_WB - motion.twist(before).v_WB).norm(), 1e-13);
    EXPECT_LT((motion.twist(t).w_WB - motion.twist(before).w_WB).norm(), 1e-13);
    EXPECT_EQ(motion.smooth_until(before), t);
  }
}

TEST(BsplineMotion, RefusesBadInputNamingIt) {
  const std::vector<ControlPoint> points(3);
  const auto refusal = [&](std::size_t degree, std::vector<Scalar> knots) {
    return message_of([&] { bspline_motion(degree, knots, Matrix3::Identity(), points); });
  };
  EXPECT_EQ(refusal(0, {0, 1, 2, 3}), "degree of B-spline motion must be 1 to 9, not 0");
  EXPECT_EQ(refusal(3, {0, 1, 2, 3, 4, 5, 6}),
            "B-spline motion of degree 3 needs at least 4 control points, not 3");
  EXPECT_EQ(refusal(2, {0, 1, 2, 3, 4}),
            "B-spline motion of degree 2 with 3 control points needs 6 knots, not 5");
  EXPECT_EQ(refusal(1, {0, 0, 2, 1, 3}),
            "knots of B-spline motion must not decrease, but knot 3 = 1 follows knot 2 = 2");
  EXPECT_EQ(refusal(1, {0, 0, kInfinity, kInfinity, kInfinity}),
            "knot 2 of B-spline motion must be finite, not inf");
  EXPECT_EQ(refusal(2, {0, 0, 0, 1, 2, 2}), "no error");
  EXPECT_EQ(refusal(2, {0, 0, 1, 1, 1, 1}),
            "domain of B-spline motion must have a positive length, not [1, 1]");
  EXPECT_EQ(message_of([&] {
              bspline_motion(1, std::vector<Scalar>{0, 0, 1, 1, 2, 2}, Matrix3::Identity(),
                             std::vector<ControlPoint>(4));
            }),
            "knot 3 = 1 of B-spline motion of degree 1 occurs more than 1 times");
  EXPECT_NE(message_of([&] {
              std::vector<ControlPoint> wrong(3);
              wrong[2].p_WB.z() = std::nan("");
              bspline_motion(1, std::vector<Scalar>{0, 0, 1, 2, 2}, Matrix3::Identity(), wrong);
            }).find("position of a control point must be finite"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
