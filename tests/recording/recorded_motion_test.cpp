// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "motion/all_motions.h"
#include "recording/motion_rows.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using internal::EncodedMotion;
using internal::MotionPart;
using testing::has_same_bits;
using testing::Random;

void expect_same(const Motion& motion, const Motion& read, const TimeInterval& interval) {
  for (int k = 0; k <= 50; ++k) {
    const Scalar t = interval.begin + interval.length() * k / 50;
    EXPECT_TRUE(has_same_bits(motion.pose(t), read.pose(t))) << t;
    EXPECT_TRUE(has_same_bits(motion.twist(t).v_WB, read.twist(t).v_WB)) << t;
    EXPECT_TRUE(has_same_bits(motion.twist(t).w_WB, read.twist(t).w_WB)) << t;
  }
}

// Every motion of dyop, at several scales and far from the origin: the same bits, or said to be
// approximate.
TEST(RecordedMotion, ReadsBackWithEveryBit) {
  int exact = 0;
  for (const testing::MotionMaker& maker : testing::kAllMotions) {
    Random random(7);
    for (const Scalar length : {1e-4, 1.0, 1e4}) {
      for (const Scalar distance : {0.0, 1e6}) {
        testing::Scales scales;
        scales.length = length;
        scales.distance = distance;
        const auto motion = maker.make(random, scales);
        const TimeInterval interval = scales.span;
        for (const MotionPart& part : internal::parts_of(motion, interval)) {
          const EncodedMotion encoded = internal::encode(part, Vector3::Zero());
          const auto read = internal::decode(encoded, Vector3::Zero());
          if (encoded.kind == SegmentKind::Approximate) {
            const Scalar begin = part.interval.begin;
            EXPECT_TRUE(
                part.motion->pose(begin).rotation().isApprox(read->pose(begin).rotation(), 1e-9));
            continue;
          }
          expect_same(*part.motion, *read, part.interval);
          ++exact;
        }
      }
    }
  }
  EXPECT_GT(exact, 60);
}

TEST(RecordedMotion, OfABodyMovesAboutItsCentreOfMass) {
  Random random(3);
  const Vector3 p_BoBcm(0.1, -0.7, 1e-3);
  const auto offset = std::make_shared<RestMotion>(RigidPose(Vector3(-p_BoBcm)));
  const TimeInterval interval{2, 3};
  const auto twist = std::make_shared<ConstantTwistMotion>(
      random.pose(5), Twist{random.in_ball(3), random.in_ball(4)}, 2);
  const auto hermite = std::make_shared<HermiteMotion>(
      interval, MotionState{random.pose(5), {random.in_ball(3), random.in_ball(1)}},
      MotionState{random.pose(5), {random.in_ball(3), random.in_ball(1)}});
  const std::vector<std::pair<std::shared_ptr<const Motion>, SegmentKind>> cases{
      {twist, SegmentKind::Twist}, {hermite, SegmentKind::Hermite}};
  for (const auto& [center, kind] : cases) {
    const MotionPart part{interval, std::make_shared<ComposedMotion>(center, offset)};
    const EncodedMotion encoded = internal::encode(part, p_BoBcm);
    EXPECT_EQ(encoded.kind, kind);
    EXPECT_EQ(encoded.numbers.size(), internal::number_count(kind));
    expect_same(*part.motion, *internal::decode(encoded, p_BoBcm), interval);
    // Of a body whose centre of mass is elsewhere it is a motion like any other.
    EXPECT_EQ(internal::encode(part, Vector3(1, 2, 3)).kind, SegmentKind::Given);
    EXPECT_EQ(internal::encode({interval, center}, p_BoBcm).kind, SegmentKind::Given);
  }
}

TEST(RecordedMotion, OfASequenceIsThatOfItsPartsWithinTheStep) {
  Random random(5);
  const RigidPose X0 = random.pose(1);
  const auto first =
      std::make_shared<ConstantTwistMotion>(X0, Twist{random.in_ball(1), random.in_ball(1)});
  const auto second =
      std::make_shared<ConstantTwistMotion>(first->pose(1), Twist{random.in_ball(1), {}}, 1);
  const auto third = std::make_shared<RestMotion>(second->pose(2));
  const auto sequence = std::make_shared<SequenceMotion>(
      std::vector<SequenceMotion::Part>{{{0, 1}, first}, {{1, 2}, second}, {{2, 3}, third}});
  const auto parts = internal::parts_of(sequence, {0.5, 2});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].motion, first);
  EXPECT_EQ(parts[0].interval.begin, 0.5);
  EXPECT_EQ(parts[0].interval.end, 1);
  EXPECT_EQ(parts[1].motion, second);
  EXPECT_EQ(internal::parts_of(first, {0.5, 2}).size(), 1u);
}

TEST(RecordedMotion, ContinuesACubicWhereTheLastOneEnded) {
  Random random(11);
  const MotionState middle{random.pose(5), {random.in_ball(3), random.in_ball(1)}};
  const auto numbers_between = [&](const TimeInterval& interval, const MotionState& begin,
                                   const MotionState& end) {
    const auto motion = std::make_shared<HermiteMotion>(interval, begin, end);
    return internal::encode({interval, motion}, Vector3::Zero()).numbers;
  };
  const auto near = [&] {
    return MotionState{RigidPose(middle.X_WB.rotation(), random.in_ball(4)),
                       {random.in_ball(3), random.in_ball(1)}};
  };
  const auto before = numbers_between({0, 1}, near(), middle);
  const auto next = numbers_between({1, 2.5}, middle, near());
  const auto elsewhere = numbers_between({1, 2.5}, near(), middle);
  ASSERT_TRUE(internal::continues(before, next));
  EXPECT_FALSE(internal::continues(before, elsewhere));
  EXPECT_FALSE(internal::continues(next, before));
  const auto rest = internal::continued_numbers(next);
  EXPECT_EQ(rest.size(), internal::kContinuedNumbers);
  EXPECT_EQ(internal::whole_numbers(internal::end_of(before), rest), next);
  // The end of a continued row is found in the row itself.
  const auto end = internal::end_of(rest);
  EXPECT_TRUE(std::equal(end.begin(), end.end(), internal::end_of(next).begin()));
}

TEST(RecordedMotion, RefusesNumbersThatAreTooFew) {
  EXPECT_THROW(internal::decode({SegmentKind::Twist, {1, 2, 3}, ""}, Vector3::Zero()),
               InvalidArgument);
  EXPECT_EQ(internal::decode({SegmentKind::Absent, {}, ""}, Vector3::Zero()), nullptr);
}

}  // namespace
}  // namespace dyop
