// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/motion_bounds.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"

namespace dyop::toi_internal {
namespace {

// A twist bound whose acceleration is the largest |t| of the interval, so that parts differ.
class GrowingMotion final : public Motion {
 public:
  RigidPose pose(Scalar) const override { return {}; }
  Twist twist(Scalar) const override { return {}; }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    const Scalar largest = std::max(std::abs(interval.begin), std::abs(interval.end));
    return {largest, largest, largest, largest};
  }
};

TEST(MotionBounds, CoverEveryPartAndAreLocal) {
  const GrowingMotion motion;
  const MotionBounds bounds(motion, {0, 8});
  std::mt19937_64 random(1);
  std::uniform_real_distribution<Scalar> uniform(0, 8);
  for (int i = 0; i < 10000; ++i) {
    Scalar begin = uniform(random);
    Scalar end = uniform(random);
    if (begin > end) std::swap(begin, end);
    const Scalar bound = bounds.over(begin, end).linear_acceleration;
    EXPECT_GE(bound, end);
    EXPECT_LE(bound, end + 3 * 8.0 / 16);
  }
}

TEST(MotionBounds, AreThoseOfTheMotionItselfForFewLookups) {
  const GrowingMotion motion;
  const MotionBounds bounds(motion, {0, 8}, BoundLookups::Few);
  EXPECT_EQ(bounds.whole().linear_acceleration, 8);
  EXPECT_EQ(bounds.over(1, 2.5).linear_acceleration, 2.5);
}

TEST(MotionBounds, AreFiniteUpToAJumpOfTheTwist) {
  const SampledMotion path(
      {{0, RigidPose()}, {1.1, RigidPose(Vector3(1, 0, 0))}, {8, RigidPose()}});
  const MotionBounds bounds(path, {0, 8});
  EXPECT_EQ(bounds.whole().linear_acceleration, kInfinity);
  EXPECT_EQ(bounds.over(0.0, 1.1).linear_acceleration, 0);
  EXPECT_EQ(bounds.over(1.1, 8.0).linear_acceleration, 0);
}

}  // namespace
}  // namespace dyop::toi_internal
