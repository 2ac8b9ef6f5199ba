// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/sampled_motion.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

using Samples = std::vector<SampledMotion::Sample>;

Samples random_samples(Random& random, int count) {
  Samples samples;
  Scalar t = -1;
  for (int i = 0; i < count; ++i) {
    samples.push_back({t, random.pose(2)});
    t += random.uniform(0.1, 1);
  }
  return samples;
}

TEST(SmoothSampledMotion, MeetsAllSamples) {
  Random random(1);
  for (int count = 2; count < 9; ++count) {
    const Samples samples = random_samples(random, count);
    const SequenceMotion motion = smooth_sampled_motion(samples);
    EXPECT_EQ(motion.domain(), (TimeInterval{samples.front().t, samples.back().t}));
    for (const auto& [t, X_WB] : samples) {
      EXPECT_LT((motion.pose(t).translation() - X_WB.translation()).norm(), 1e-13);
      EXPECT_LT((motion.pose(t).rotation() - X_WB.rotation()).norm(), 1e-13);
    }
  }
}

TEST(SmoothSampledMotion, TwistIsContinuousAtEveryStamp) {
  Random random(2);
  const Samples samples = random_samples(random, 12);
  const SequenceMotion motion = smooth_sampled_motion(samples);
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const Scalar before = std::nextafter(samples[i].t, -2);
    const Twist left = motion.twist(before), right = motion.twist(samples[i].t);
    EXPECT_LT((left.v_WB - right.v_WB).norm(), 1e-11) << i;
    EXPECT_LT((left.w_WB - right.w_WB).norm(), 1e-11) << i;
  }
}

// Samples of a fall x = 3 t - 2 t^2 and of a turn about z by the angle t + t^2/2 at uneven stamps:
// parabolas, which the velocities at the stamps and the cubics between them reproduce.
TEST(SmoothSampledMotion, ReproducesParabolas) {
  const auto x = [](Scalar t) { return Vector3(3 * t - 2 * t * t, 0, 0); };
  const auto angle = [](Scalar t) { return Vector3(0, 0, t + t * t / 2); };
  Samples samples;
  for (const Scalar t : {0.0, 0.2, 0.7, 0.8, 1.3}) {
    samples.push_back({t, RigidPose(rotation_from_vector(angle(t)), x(t))});
  }
  const SequenceMotion motion = smooth_sampled_motion(samples);
  for (Scalar t = 0; t < 1.3; t += 1.0 / 64) {
    EXPECT_LT((motion.pose(t).translation() - x(t)).norm(), 1e-14);
    EXPECT_LT((motion.pose(t).rotation() - rotation_from_vector(angle(t))).norm(), 1e-14);
    EXPECT_NEAR(motion.twist(t).w_WB.z(), 1 + t, 1e-13);
  }
  EXPECT_NEAR(motion.twist_bound({0.3, 0.6}).linear_acceleration, 4, 1e-11);
}

TEST(SmoothSampledMotion, TwoSamplesGiveAConstantTwist) {
  const SequenceMotion motion = smooth_sampled_motion(
      {{1, RigidPose()}, {3, RigidPose(rotation_from_vector(Vector3(0, 2, 0)), Vector3(4, 0, 0))}});
  EXPECT_LT((motion.twist(1).v_WB - Vector3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((motion.twist(2.3).w_WB - Vector3(0, 1, 0)).norm(), 1e-14);
}

TEST(SmoothSampledMotion, RefusesWhatSampledMotionRefuses) {
  EXPECT_EQ(message_of([] {
              smooth_sampled_motion({{0, RigidPose()}});
            }),
            "sampled motion needs at least 2 samples, not 1");
  EXPECT_NE(message_of([] {
              smooth_sampled_motion({{0, RigidPose()}, {0, RigidPose()}});
            }).find("must increase"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
