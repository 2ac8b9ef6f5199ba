// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/sampled_motion.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

RigidPose at(Scalar x, Scalar turn = 0) {
  return RigidPose(rotation_from_vector(Vector3(0, 0, turn)), Vector3(x, 0, 0));
}

// Speeds 1, 4 and 2; turns at rates 0, 1 and 0.5.
SampledMotion example_samples() {
  return SampledMotion({{0, at(0)}, {1, at(1)}, {1.5, at(3, 0.5)}, {3.5, at(-1, 1.5)}});
}

TEST(SampledMotion, InterpolatesLinearlyBetweenStamps) {
  const SampledMotion motion = example_samples();
  EXPECT_DOUBLE_EQ(motion.pose(1.25).translation().x(), 2);
  EXPECT_DOUBLE_EQ(rotation_vector(motion.pose(1.25).rotation()).z(), 0.25);
  EXPECT_DOUBLE_EQ(motion.pose(3.5).translation().x(), -1);
  EXPECT_DOUBLE_EQ(rotation_vector(motion.pose(3.5).rotation()).z(), 1.5);
}

TEST(SampledMotion, TwistAtAStampIsTheOneFromTheRight) {
  const SampledMotion motion = example_samples();
  EXPECT_DOUBLE_EQ(motion.twist(1).v_WB.x(), 4);
  EXPECT_DOUBLE_EQ(motion.twist(3.5).v_WB.x(), -2) << "the last piece at the end of the domain";
}

TEST(SampledMotion, IsSmoothUntilTheNextStamp) {
  const SampledMotion motion = example_samples();
  EXPECT_EQ(motion.smooth_until(0), 1);
  EXPECT_EQ(motion.smooth_until(0.5), 1);
  EXPECT_EQ(motion.smooth_until(1), 1.5);
  EXPECT_EQ(motion.smooth_until(3), 3.5);
  EXPECT_EQ(motion.smooth_until(3.5), kInfinity);
  EXPECT_EQ(motion.domain().begin, 0);
  EXPECT_EQ(motion.domain().end, 3.5);
}

TEST(SampledMotion, BoundsOnePieceTightlyUpToItsStamps) {
  const SampledMotion motion = example_samples();
  const TwistBound bound = motion.twist_bound({0, 1});
  EXPECT_NEAR(bound.linear_speed, 1, 1e-13);
  EXPECT_EQ(bound.angular_speed, 0);
  EXPECT_EQ(bound.linear_acceleration, 0);
  EXPECT_NEAR(motion.twist_bound({1, 1}).linear_speed, 4, 1e-12);
}

TEST(SampledMotion, AccelerationsAreInfiniteAndSpeedsFiniteAcrossAStamp) {
  const TwistBound bound = example_samples().twist_bound({0.5, 1.25});
  EXPECT_NEAR(bound.linear_speed, 4, 1e-12);
  EXPECT_NEAR(bound.angular_speed, 1, 1e-12);
  EXPECT_EQ(bound.linear_acceleration, kInfinity);
  EXPECT_EQ(bound.angular_acceleration, kInfinity);
}

// The tree of speeds against a plain loop, for every range of pieces and several counts.
TEST(SampledMotion, SpeedBoundIsTheLargestOfThePieces) {
  Random random(9);
  for (const int count : {1, 2, 3, 5, 8, 13, 21}) {
    std::vector<SampledMotion::Sample> samples{{0, at(0)}};
    std::vector<Scalar> speeds;
    for (int i = 1; i <= count; ++i) {
      speeds.push_back(random.uniform(0, 10));
      samples.push_back({Scalar(i), at(samples.back().X_WB.translation().x() + speeds.back())});
    }
    const SampledMotion motion(samples);
    for (int i = 0; i < count; ++i) {
      for (int k = i; k < count; ++k) {
        const Scalar expected = *std::max_element(speeds.begin() + i, speeds.begin() + k + 1);
        EXPECT_NEAR(motion.twist_bound({i + 0.25, k + 0.75}).linear_speed, expected, 1e-12);
      }
    }
  }
}

TEST(SampledMotion, NamesIndexAndValuesOfBadStamps) {
  EXPECT_EQ(message_of([] {
              SampledMotion({{0, at(0)}, {2, at(1)}, {2, at(2)}});
            }),
            "time stamps of sampled motion must increase, but stamp 2 = 2 follows stamp 1 = 2");
  EXPECT_EQ(message_of([] {
              SampledMotion({{0, at(0)}, {std::nan(""), at(1)}});
            }),
            "time stamp 1 of sampled motion must be finite, not nan");
  EXPECT_EQ(message_of([] {
              SampledMotion({{0, at(0)}});
            }),
            "sampled motion needs at least 2 samples, not 1");
  EXPECT_NE(message_of([] {
              SampledMotion({{0, at(0)}, {1e-310, at(1)}});
            }).find("too close"),
            std::string::npos);
  // Every part of the angular velocity is a number, but their squares are not.
  EXPECT_NE(message_of([] {
              SampledMotion({{0, at(0)}, {1e-200, RigidPose(rotation_from_vector({1, 1, 1}), {})}});
            }).find("too close"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
