// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/steady_motions.h"
#include "motion/random_values.h"

namespace dyop::testing {
namespace {

TEST(RestMotion, KeepsItsPoseForEver) {
  Random random(1);
  const RigidPose X_WB = random.pose(5);
  const RestMotion motion(X_WB);
  for (const Scalar t : {-1e300, 0.0, 7.5}) {
    EXPECT_EQ(motion.pose(t).translation(), X_WB.translation());
    EXPECT_EQ(motion.pose(t).rotation(), X_WB.rotation());
    EXPECT_EQ(motion.twist(t).v_WB.norm() + motion.twist(t).w_WB.norm(), 0);
  }
  EXPECT_EQ(motion.domain().end, kInfinity);
  EXPECT_EQ(motion.smooth_until(3), kInfinity);
}

TEST(RestMotion, HasZeroBounds) {
  const TwistBound bound = RestMotion().twist_bound({0, 10});
  EXPECT_EQ(bound.linear_speed, 0);
  EXPECT_EQ(bound.angular_speed, 0);
  EXPECT_EQ(bound.linear_acceleration, 0);
  EXPECT_EQ(bound.angular_acceleration, 0);
}

}  // namespace
}  // namespace dyop::testing
