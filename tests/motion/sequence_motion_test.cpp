// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

using Parts = std::vector<SequenceMotion::Part>;

std::shared_ptr<const Motion> sliding(Scalar x, Scalar speed, Scalar t) {
  return std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(x, 0, 0)),
                                               Twist{Vector3(speed, 0, 0), Vector3::Zero()}, t);
}

// To x = 2 at speed 1, a pause, and on at speed 3.
SequenceMotion example_sequence() {
  return SequenceMotion({{{0, 2}, sliding(0, 1, 0)},
                         {{2, 5}, std::make_shared<RestMotion>(RigidPose(Vector3(2, 0, 0)))},
                         {{5, 6}, sliding(2, 3, 5)}});
}

TEST(SequenceMotion, RunsOnePartAfterTheOther) {
  const SequenceMotion motion = example_sequence();
  EXPECT_EQ(motion.domain(), (TimeInterval{0, 6}));
  for (const auto& [t, x] :
       {std::pair(0.5, 0.5), std::pair(2.0, 2.0), std::pair(4.0, 2.0), std::pair(6.0, 5.0)}) {
    EXPECT_DOUBLE_EQ(motion.pose(t).translation().x(), x);
    EXPECT_DOUBLE_EQ(motion.state(t).X_WB.translation().x(), x);
  }
  EXPECT_EQ(motion.twist(2).v_WB.x(), 0) << "from the right";
  EXPECT_EQ(motion.twist(6).v_WB.x(), 3) << "from the left at the end of all";
}

TEST(SequenceMotion, BoundsTheSpeedsOfAllPartsThatTheIntervalOverlaps) {
  const SequenceMotion motion = example_sequence();
  EXPECT_NEAR(motion.twist_bound({1, 4}).linear_speed, 1, 1e-12);
  EXPECT_NEAR(motion.twist_bound({1, 5.5}).linear_speed, 3, 1e-12);
  EXPECT_EQ(motion.twist_bound({2, 5}).linear_speed, 0);
  EXPECT_EQ(motion.twist_bound({2, 5}).linear_acceleration, 0);
  EXPECT_EQ(motion.twist_bound({1, 4}).linear_acceleration, kInfinity);
}

TEST(SequenceMotion, IsSmoothUntilThePartEndsOrIsNotSmoothItself) {
  const auto inner = std::make_shared<SampledMotion>(std::vector<SampledMotion::Sample>{
      {2, RigidPose(Vector3(2, 0, 0))}, {3, RigidPose()}, {5, RigidPose()}});
  const SequenceMotion motion({{{0, 2}, sliding(0, 1, 0)}, {{2, 4}, inner}});
  EXPECT_EQ(motion.smooth_until(1), 2);
  EXPECT_EQ(motion.smooth_until(2), 3);
  EXPECT_EQ(motion.smooth_until(3), 4);
  EXPECT_EQ(motion.smooth_until(4), kInfinity);
}

TEST(SequenceMotion, RefusesPartsThatDoNotMeet) {
  const auto refusal = [](const Parts& parts) {
    return message_of([&] { SequenceMotion{parts}; });
  };
  EXPECT_EQ(refusal({}), "sequence motion needs at least one part");
  EXPECT_EQ(refusal({{{0, 1}, nullptr}}), "motion of part 0 of sequence motion is null");
  EXPECT_EQ(refusal({{{0, 0}, sliding(0, 1, 0)}}),
            "interval of part 0 of sequence motion must have a positive length, not [0, 0]");
  EXPECT_EQ(refusal({{{0, 1}, sliding(0, 1, 0)}, {{1.5, 2}, sliding(0, 1, 0)}}),
            "part 1 of sequence motion must start where part 0 ends, at 1, not at 1.5");
  EXPECT_EQ(refusal({{{0, 1}, sliding(0, 1, 0)}, {{1, 2}, sliding(1.25, 1, 1)}}),
            "parts 0 and 1 of sequence motion do not meet at time 1: the position jumps by 0.25, "
            "the rotation matrix by 0");
  EXPECT_NE(refusal({{{0, 9},
                      std::make_shared<SampledMotion>(
                          std::vector<SampledMotion::Sample>{{0, RigidPose()}, {1, RigidPose()}})}})
                .find("is defined only on [0, 1], not on all of [0, 9]"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
