// SPDX-License-Identifier: BSD-3-Clause

// Rounding of poses that are computed from something large: a time since long ago, control points
// far away. Beside the same formulas in extended precision.

#include <gtest/gtest.h>

#include <array>
#include <memory>

#include "core/tolerance.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/random_values.h"

namespace dyop::testing {
namespace {

using Long = long double;
using LongVector = Eigen::Matrix<Long, 3, 1>;
using LongMatrix = Eigen::Matrix<Long, 3, 3>;

struct LongPose {
  LongMatrix R;
  LongVector p;
};

LongVector widen(const Vector3& x) {
  return x.cast<Long>();
}

// exp(angle [axis]).
LongMatrix turn(const LongVector& axis, Long angle) {
  return Eigen::AngleAxis<Long>(angle, axis.normalized()).toRotationMatrix();
}

// Largest used fraction of what pose_scale() allows, for points at distances up to 10.
Scalar used_allowance(const Motion& motion, const TimeInterval& interval, Scalar t,
                      const LongPose& exact, Random& random) {
  const PoseScale scale = motion.pose_scale(interval);
  const RigidPose X_WB = motion.pose(t);
  Scalar worst = 0;
  for (const Scalar radius : {0.0, 0.1, 10.0}) {
    const Vector3 p_B = radius * random.direction();
    const LongVector exact_place = exact.R * widen(p_B) + exact.p;
    const LongVector place = X_WB.rotation().cast<Long>() * widen(p_B) + widen(X_WB.translation());
    const auto error = static_cast<Scalar>((place - exact_place).norm());
    worst = std::max(worst, error / (kPoseNoise * (scale.length + scale.angle * radius)));
  }
  return worst;
}

constexpr std::array<Scalar, 4> kLongAgo{0, -3, 1e5, -1e9};

TEST(PoseScale, OfAConstantTwistCountsFromItsReferenceTime) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Scalar t0 = kLongAgo[static_cast<std::size_t>(i % 4)];
    const RigidPose X = random.pose(5);
    const Twist twist{random.in_ball(3), random.in_ball(7)};
    const ConstantTwistMotion motion(X, twist, t0);
    const Scalar t = random.uniform(0, 1);
    const Long tau = Long(t) - Long(t0);
    const LongVector w = widen(twist.w_WB);
    const LongPose exact{turn(w, w.norm() * tau) * X.rotation().cast<Long>(),
                         widen(X.translation()) + tau * widen(twist.v_WB)};
    ASSERT_LE(used_allowance(motion, {0, 1}, t, exact, random), 1) << t0;
  }
}

TEST(PoseScale, OfAScrewCountsFromItsReferenceTime) {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const Scalar t0 = kLongAgo[static_cast<std::size_t>(i % 4)];
    const RigidPose X = random.pose(5);
    const ScrewMotion::Screw screw{random.in_ball(3), random.direction(), random.uniform(-7, 7),
                                   random.uniform(-2, 2)};
    const ScrewMotion motion(X, screw, t0);
    const Scalar t = random.uniform(0, 1);
    const Long tau = Long(t) - Long(t0);
    const LongVector axis = widen(screw.axis_W).normalized();
    const LongMatrix R = turn(axis, Long(screw.turn_rate) * tau);
    const LongVector p_WA = widen(screw.p_WA);
    const LongPose exact{R * X.rotation().cast<Long>(), p_WA + R * (widen(X.translation()) - p_WA) +
                                                            Long(screw.slide_rate) * tau * axis};
    ASSERT_LE(used_allowance(motion, {0, 1}, t, exact, random), 1) << t0;
  }
}

// Control points as large as `reach` at both ends of a long domain; the middle is near the origin.
TEST(PoseScale, OfABezierCurveCountsItsControlPoints) {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const std::size_t degree = 1 + static_cast<std::size_t>(i) % BezierMotion::kMaxDegree;
    const Scalar reach = i % 2 == 0 ? 1 : 1e9;
    std::vector<ControlPoint> points(degree + 1);
    for (ControlPoint& point : points) point = {random.in_ball(reach), random.in_ball(reach / 1e3)};
    const BezierMotion motion({-1e3, 1e3}, random.rotation(), points);
    const Scalar t = random.uniform(-1, 1);
    const Long s = (Long(t) + 1e3L) / 2e3L;
    LongVector p = LongVector::Zero(), theta = LongVector::Zero();
    Long weight = std::pow(1 - s, Long(degree));
    for (std::size_t k = 0; k <= degree; ++k) {
      p += weight * widen(points[k].p_WB);
      theta += weight * widen(points[k].theta);
      weight *= s / (1 - s) * Long(degree - k) / Long(k + 1);
    }
    const LongPose exact{motion.X_WC().rotation().cast<Long>() * turn(theta, theta.norm()), p};
    ASSERT_LE(used_allowance(motion, {-1, 1}, t, exact, random), 1) << degree << ' ' << reach;
  }
}

TEST(PoseScale, OfAnInterpolationCountsBothEnds) {
  Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const Scalar reach = i % 2 == 0 ? 1 : 1e9;
    const Vector3 p0 = random.in_ball(reach), p1 = random.in_ball(reach);
    const Vector3 theta0 = random.in_ball(reach / 1e3), theta1 = random.in_ball(reach / 1e3);
    const Matrix3 R_WC = random.rotation();
    const auto motion = InterpolatedMotion::from_chart(
        {-1e3, 1e3}, RigidPose(R_WC, Vector3::Zero()), {p0, theta0}, {p1, theta1});
    const Scalar t = random.uniform(-1, 1);
    const Long s = (Long(t) + 1e3L) / 2e3L;
    const LongVector theta = (1 - s) * widen(theta0) + s * widen(theta1);
    const LongPose exact{
        RigidPose(R_WC, Vector3::Zero()).rotation().cast<Long>() * turn(theta, theta.norm()),
        (1 - s) * widen(p0) + s * widen(p1)};
    ASSERT_LE(used_allowance(motion, {-1, 1}, t, exact, random), 1) << reach;
  }
}

TEST(PoseScale, OfACompositionCountsBothMotions) {
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const RigidPose X_WM = random.pose(5), X_MB = random.pose(100);
    const Twist outer{random.in_ball(3), random.in_ball(7)};
    const Twist inner{random.in_ball(3), random.in_ball(7)};
    const Scalar t0 = kLongAgo[static_cast<std::size_t>(i % 4)];
    const Scalar t1 = kLongAgo[static_cast<std::size_t>(i / 4 % 4)];
    const ComposedMotion motion(std::make_shared<ConstantTwistMotion>(X_WM, outer, t0),
                                std::make_shared<ConstantTwistMotion>(X_MB, inner, t1));
    const Scalar t = random.uniform(0, 1);
    const auto at = [&](const RigidPose& X, const Twist& twist, Scalar begin) {
      const Long tau = Long(t) - Long(begin);
      const LongVector w = widen(twist.w_WB);
      return LongPose{turn(w, w.norm() * tau) * X.rotation().cast<Long>(),
                      widen(X.translation()) + tau * widen(twist.v_WB)};
    };
    const LongPose x = at(X_WM, outer, t0), y = at(X_MB, inner, t1);
    const LongPose exact{x.R * y.R, x.R * y.p + x.p};
    ASSERT_LE(used_allowance(motion, {0, 1}, t, exact, random), 1) << t0 << ' ' << t1;
  }
}

// For a sequence: the largest of its parts, even if another part is evaluated.
TEST(PoseScale, OfASequenceIsThatOfItsParts) {
  const auto rest = std::make_shared<RestMotion>(RigidPose(Vector3(3, 0, 4)));
  const SequenceMotion motion({{{0, 1}, rest}, {{1, 2}, rest}});
  EXPECT_EQ(motion.pose_scale({0, 2}).length, rest->pose_scale({0, 1}).length);
  EXPECT_GE(motion.pose_scale({0, 2}).length, 5);
}

// A body at rest whose place jumps by rounding at every meeting has moved in the end, though its
// speed is zero: the sum of the jumps in the interval is part of the scale.
TEST(PoseScale, OfASequenceCountsTheJumpsThatItCrosses) {
  constexpr int kParts = 1000;
  const Scalar jump = 2e-14;
  std::vector<SequenceMotion::Part> parts;
  for (int i = 0; i < kParts; ++i) {
    const Vector3 p_WB(3 + i * jump, 0, 0);
    parts.push_back({{Scalar(i), Scalar(i + 1)}, std::make_shared<RestMotion>(RigidPose(p_WB))});
  }
  const SequenceMotion motion(parts);
  const auto moved = [&](Scalar begin, Scalar end) {
    return (motion.pose(end).translation() - motion.pose(begin).translation()).norm();
  };
  for (const auto& [begin, end] : {std::pair(0.0, 1000.0), std::pair(10.5, 20.5)}) {
    EXPECT_GT(moved(begin, end), jump * 9);
    EXPECT_LE(moved(begin, end), kPoseNoise * motion.pose_scale({begin, end}).length);
  }
  EXPECT_LT(motion.pose_scale({10.5, 20.5}).length, motion.pose_scale({0, 1000}).length / 2);
}

}  // namespace
}  // namespace dyop::testing
