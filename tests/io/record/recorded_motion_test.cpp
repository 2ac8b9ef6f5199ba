// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "io/record/motion_rows.h"
#include "motion/all_motions.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using io_internal::EncodedMotion;
using io_internal::MotionPart;
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
        for (const MotionPart& part : io_internal::parts_of(motion, interval)) {
          const EncodedMotion encoded = io_internal::encode(part, Vector3::Zero());
          const auto read = io_internal::decode(encoded, Vector3::Zero());
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
    const EncodedMotion encoded = io_internal::encode(part, p_BoBcm);
    EXPECT_EQ(encoded.kind, kind);
    EXPECT_EQ(encoded.numbers.size(), io_internal::number_count(kind));
    expect_same(*part.motion, *io_internal::decode(encoded, p_BoBcm), interval);
    // If the centre of mass is elsewhere it is a motion like any other.
    EXPECT_EQ(io_internal::encode(part, Vector3(1, 2, 3)).kind, SegmentKind::Given);
    EXPECT_EQ(io_internal::encode({interval, center}, p_BoBcm).kind, SegmentKind::Given);
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
  const auto parts = io_internal::parts_of(sequence, {0.5, 2});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].motion, first);
  EXPECT_EQ(parts[0].interval.begin, 0.5);
  EXPECT_EQ(parts[0].interval.end, 1);
  EXPECT_EQ(parts[1].motion, second);
  EXPECT_EQ(io_internal::parts_of(first, {0.5, 2}).size(), 1u);
}

// The second of each pair of cubics is stored in the form given, and read back whole.
TEST(RecordedMotion, OfACubicIsStoredInItsShortestForm) {
  Random random(11);
  const auto some = [&](std::size_t count) {
    std::vector<Scalar> numbers;
    while (numbers.size() < count) numbers.push_back(random.uniform(-1, 1));
    return numbers;
  };
  struct Case {
    std::uint32_t kind;
    bool is_same_chart;
    std::size_t shared;  // numbers of the start that are those of the end before
    std::size_t count;
  };
  for (const Case& one : {Case{3, false, 0, 35}, Case{3, false, 6, 35}, Case{6, false, 7, 28},
                          Case{6, false, 13, 28}, Case{7, true, 0, 27}, Case{7, true, 6, 27},
                          Case{8, true, 7, 20}, Case{8, true, 12, 20}, Case{9, true, 13, 14}}) {
    const std::vector<Scalar> before = some(35);
    std::vector<Scalar> next = some(35);
    if (one.is_same_chart) std::copy_n(before.begin(), 9, next.begin());
    std::copy_n(before.end() - 13, one.shared, next.begin() + 9);
    const std::span<const Scalar> chart = std::span(before).first(9);
    const io_internal::HermiteForm& form = io_internal::shortest_form(before, chart, next);
    EXPECT_EQ(form.kind, one.kind);
    EXPECT_EQ(io_internal::hermite_form(one.kind), &form);
    const auto stored = io_internal::stored_numbers(form, 1234, next);
    EXPECT_EQ(stored.size(), one.count);
    EXPECT_EQ(form.count(), one.count);
    EXPECT_EQ(stored[0], one.is_same_chart ? 1234 : next[0]);
    const auto read = io_internal::whole_numbers(form, std::span(next).first(9),
                                                 std::span(before).last(13), stored);
    EXPECT_EQ(read, next);
    // The end of a row is found in the row itself.
    EXPECT_TRUE(std::equal(stored.end() - 13, stored.end(), next.end() - 13));
    // Nothing to continue, no chart.
    EXPECT_EQ(io_internal::shortest_form({}, chart, next).kind, one.is_same_chart ? 7u : 3u);
    EXPECT_EQ(io_internal::shortest_form({}, {}, next).kind, 3u);
  }
}

// A zero with a sign is not the other zero.
TEST(RecordedMotion, OfACubicKeepsTheSignOfZero) {
  const std::vector<Scalar> before(35, 0.0);
  std::vector<Scalar> next = before;
  EXPECT_EQ(io_internal::shortest_form(before, std::span(before).first(9), next).kind, 9u);
  next[8] = -0.0;
  EXPECT_EQ(io_internal::shortest_form(before, std::span(before).first(9), next).kind, 6u);
}

TEST(RecordedMotion, RefusesNumbersThatAreTooFew) {
  EXPECT_THROW(io_internal::decode({SegmentKind::Twist, {1, 2, 3}, ""}, Vector3::Zero()),
               InvalidArgument);
  EXPECT_EQ(io_internal::decode({SegmentKind::Absent, {}, ""}, Vector3::Zero()), nullptr);
}

}  // namespace
}  // namespace dyop
