// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/impact_derivatives.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

// Random queries against central differences: tests/property/derivatives_soak.cpp.
namespace dyop {
namespace {

const Sphere kBall(1);
const RestMotion kAtRest{RigidPose()};

ConstantTwistMotion flying(const Vector3& p, const Vector3& v) {
  return {RigidPose(p), {v, Vector3::Zero()}};
}

// A ball of radius 1 flies along x past another, off by y0: they touch at
// x = -sqrt(4 - y0^2), t = (x - x0) / speed.
TEST(ImpactDerivatives, OfTwoBallsAreTheClosedForm) {
  const Scalar y0 = 0.8;
  const ConstantTwistMotion motion = flying({-5, y0, 0}, {2, 0, 0});
  ToiOptions query;
  query.distance_tolerance = 1e-7;
  const ToiResult hit = time_of_impact(kBall, kAtRest, kBall, motion, {0, 5}, query);
  ASSERT_EQ(hit.status, ToiStatus::Impact);
  const ImpactDerivatives found =
      impact_derivatives(kBall, kAtRest, kBall, motion, hit, {.tolerance = 1e-2});
  ASSERT_EQ(found.status, DerivativeStatus::Proven);
  const Scalar slope = y0 / std::sqrt(4 - y0 * y0);
  EXPECT_NEAR(found.closing_speed, 2 * std::sqrt(4 - y0 * y0) / 2, 1e-6);
  // By the pose at the impact, and so by the initial one: nothing turns.
  EXPECT_NEAR(found.by_b.translation.x(), -0.5, 1e-6);
  EXPECT_NEAR(found.by_b.translation.y(), slope / 2, 1e-6);
  EXPECT_LE(found.by_b.rotation.norm(), 1e-6);
  EXPECT_NEAR(found.by_a.translation.x(), 0.5, 1e-6);
  // By the speed: t = s / speed.
  const Twist faster = motion.pose_change(hit.t_safe, {}, {Vector3::UnitX(), Vector3::Zero()});
  EXPECT_NEAR(found.by_b.along(faster), -hit.t_safe / 2, 1e-6);
}

TEST(ImpactDerivatives, FlagFacesThatMeet) {
  const Box box({1, 1, 1});
  const ConstantTwistMotion motion = flying({0.2, 0.1, 5}, {0, 0, -1});
  const ToiResult hit = time_of_impact(box, kAtRest, box, motion, {0, 5});
  ASSERT_EQ(hit.status, ToiStatus::Impact);
  EXPECT_EQ(impact_derivatives(box, kAtRest, box, motion, hit).status, DerivativeStatus::Tie);
}

TEST(ImpactDerivatives, FlagBodiesThatGraze) {
  // The balls would miss if they were off by 2: they hardly close when they touch.
  const ConstantTwistMotion motion = flying({-5, 2 - 1e-9, 0}, {2, 0, 0});
  const ToiResult hit = time_of_impact(kBall, kAtRest, kBall, motion, {0, 5});
  ASSERT_EQ(hit.status, ToiStatus::Impact);
  EXPECT_EQ(
      impact_derivatives(kBall, kAtRest, kBall, motion, hit, {.grazing_fraction = 0.01}).status,
      DerivativeStatus::Grazing);
}

TEST(ImpactDerivatives, RefuseWhatIsNoImpact) {
  const ConstantTwistMotion motion = flying({-5, 3, 0}, {2, 0, 0});
  const ToiResult miss = time_of_impact(kBall, kAtRest, kBall, motion, {0, 5});
  ASSERT_EQ(miss.status, ToiStatus::Separated);
  EXPECT_THROW(impact_derivatives(kBall, kAtRest, kBall, motion, miss), InvalidArgument);
  ToiResult hit = miss;
  hit.status = ToiStatus::Impact;
  EXPECT_THROW(impact_derivatives(kBall, kAtRest, kBall, motion, hit, {.grazing_fraction = 1}),
               InvalidArgument);
  EXPECT_THROW(impact_derivatives(kBall, kAtRest, kBall, motion, hit, {.tolerance = -1}),
               InvalidArgument);
}

}  // namespace
}  // namespace dyop
