// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/composed_motion.h"

#include <gtest/gtest.h>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

std::shared_ptr<const Motion> turntable() {
  return std::make_shared<ConstantTwistMotion>(RigidPose(),
                                               Twist{Vector3(1, 0, 0), Vector3(0, 0, 2)});
}

// At rest at distance 3 on a table that turns at 2 and moves at 1: speed up to 1 + 6, centripetal
// acceleration 12.
TEST(ComposedMotion, BoundsABodyAtRestOnATurntableTightly) {
  const ComposedMotion motion(turntable(),
                              std::make_shared<RestMotion>(RigidPose(Vector3(3, 0, 0))));
  const TwistBound bound = motion.twist_bound({0, 10});
  EXPECT_NEAR(bound.linear_speed, 7, 1e-11);
  EXPECT_NEAR(bound.angular_speed, 2, 1e-11);
  EXPECT_NEAR(bound.linear_acceleration, 12, 1e-11);
  EXPECT_EQ(bound.angular_acceleration, 0);
  EXPECT_LT((motion.twist(0).v_WB - Vector3(1, 6, 0)).norm(), 1e-14);
}

TEST(ComposedMotion, IsDefinedWhereBothAre) {
  const auto inner =
      std::make_shared<InterpolatedMotion>(TimeInterval{2, 5}, RigidPose(), RigidPose());
  const ComposedMotion motion(turntable(), inner);
  EXPECT_EQ(motion.domain().begin, 2);
  EXPECT_EQ(motion.domain().end, 5);
  EXPECT_EQ(motion.smooth_until(3), 5);
}

TEST(ComposedMotion, RefusesNullAndMotionsWithoutCommonTime) {
  EXPECT_EQ(message_of([] { ComposedMotion(turntable(), nullptr); }),
            "composed motion needs two motions, but one is null");
  const auto early =
      std::make_shared<InterpolatedMotion>(TimeInterval{0, 1}, RigidPose(), RigidPose());
  const auto late =
      std::make_shared<InterpolatedMotion>(TimeInterval{2, 3}, RigidPose(), RigidPose());
  EXPECT_EQ(message_of([&] { ComposedMotion(early, late); }),
            "the two motions of a composed motion have no time in common: one starts at 2, the "
            "other ends at 1");
}

}  // namespace
}  // namespace dyop::testing
