// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/box_steps.h"

#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "geometry/shape_tree.h"
#include "support/oracles/box_oracle.h"

namespace dyop::toi_internal {
namespace {

using testing::corners_of;
using testing::random_box;
using testing::surface_distance;

constexpr int kWidth = BoxGroup::kWidth;

// Body S at the world's origin turns at wS; body O starts at p, turns at wO, and flies with v and
// an acceleration of size `pull` towards S.
struct RandomCase {
  BoxGroup group;
  BoxFrame frame{.scale = 4};
  OrientedBox other;
  Vector3 pull;
  FacingPiece piece;
  FacingMotion motion{};

  Vector3 origin_of_other(Scalar s) const {
    return map(motion.origin) + s * map(motion.velocity) + s * s / 2 * pull;
  }
  RigidPose pose_of_group(Scalar s) const {
    return RigidPose(rotation_from_vector(s * map(motion.turning)), Vector3::Zero());
  }
  RigidPose pose_of_other(Scalar s) const {
    return RigidPose(rotation_from_vector(s * map(motion.other_turning)), origin_of_other(s));
  }
  static Vector3 map(const double* v) { return {v[0], v[1], v[2]}; }
};

void set(double* to, const Vector3& from) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

// Largest distance of a corner from the origin of its body.
Scalar radius_of(const OrientedBox& box) {
  return box.center.norm() + box.half_extents.norm();
}

RandomCase random_case(std::mt19937_64& random, Scalar rate, Scalar acceleration) {
  RandomCase c;
  for (int k = 0; k < kWidth; ++k) c.group.set_box(k, random_box(0.5, random), c.frame);
  c.other = random_box(0.5, random);
  const Vector3 p =
      testing::random_vector(1, random).normalized() * testing::random_number(1, 4, random);
  c.pull = -acceleration * p.normalized();
  set(c.motion.origin, p);
  set(c.motion.velocity, -p.normalized() + testing::random_vector(0.5, random));
  set(c.motion.turning, testing::random_vector(rate, random));
  set(c.motion.other_turning, testing::random_vector(rate, random));
  FacingMotion& m = c.motion;
  m.turning_sq = RandomCase::map(m.turning).squaredNorm();
  m.other_turning_sq = RandomCase::map(m.other_turning).squaredNorm();
  m.largest_turning = std::sqrt(std::max(m.turning_sq, m.other_turning_sq)) * (1 + 0x1p-50);
  m.origin_distance = p.norm();
  m.origin_opening = p.dot(RandomCase::map(m.velocity)) / p.norm();
  m.remaining = m.horizon = 2;
  m.linear_acceleration = acceleration;
  m.linear_speed = RandomCase::map(m.velocity).norm() + 2 * acceleration;
  m.angular_speed = std::sqrt(m.turning_sq);
  m.other_angular_speed = std::sqrt(m.other_turning_sq);
  m.floor = 1e-3;
  m.noise = 20 * kStepNoise;
  m.is_steady = rate == 0 && acceleration == 0;
  c.piece.box = facing_box(c.other, RigidPose(p));
  set(c.piece.from_origin, c.other.center);
  c.piece.radius = radius_of(c.other) * (1 + 1e-12);
  c.piece.half_diagonal = c.other.half_extents.norm();
  return c;
}

BoxSteps steps_of(const RandomCase& c, InstructionSet set = best_instruction_set()) {
  BoxSteps steps{};
  box_steps_kernels(set).group(geometry_internal::rows_of(c.group, c.frame), 0, kWidth, c.piece,
                               c.motion, &steps);
  return steps;
}

Scalar distance_at(const RandomCase& c, int column, Scalar s) {
  return surface_distance(corners_of(c.group.box(column, c.frame), c.pose_of_group(s)),
                          corners_of(c.other, c.pose_of_other(s)));
}

class BoxStepsProperty : public ::testing::TestWithParam<std::pair<Scalar, Scalar>> {};

// The boxes at sampled times until the step ends, by the exact distance of their faces.
TEST_P(BoxStepsProperty, NeverPassTheFloorAndAreNotWasteful) {
  const auto [rate, acceleration] = GetParam();
  std::mt19937_64 random(7);
  int limited = 0;
  std::vector<Scalar> efficiency;
  for (int k = 0; k < 40; ++k) {
    const RandomCase c = random_case(random, rate, acceleration);
    const BoxSteps steps = steps_of(c);
    for (int column = 0; column < kWidth; ++column) {
      const Scalar time = steps.time[column];
      ASSERT_TRUE(time >= 0);
      if (time == 0) continue;
      const Scalar end = std::min(time, c.motion.remaining);
      for (int i = 0; i <= 6; ++i) {
        ASSERT_GE(distance_at(c, column, end * i / 6), c.motion.floor - c.motion.noise)
            << "case " << k << " column " << column << " at " << i << " / 6 of " << time;
      }
      if (time == kInfinity) continue;
      ++limited;
      // How far one step gets towards the time at which the boxes really meet, if they do.
      Scalar truth = time;
      while (truth < c.motion.remaining && distance_at(c, column, truth) > c.motion.floor) {
        truth += 0.05;
      }
      efficiency.push_back(time / truth);
    }
  }
  ASSERT_GT(limited, 40);
  std::sort(efficiency.begin(), efficiency.end());
  EXPECT_GT(efficiency[efficiency.size() / 2], rate > 3 ? 0.15 : 0.4);
}

INSTANTIATE_TEST_SUITE_P(RatesAndAccelerations, BoxStepsProperty,
                         ::testing::Values(std::pair(0.0, 0.0), std::pair(0.0, 0.5),
                                           std::pair(1.0, 0.0), std::pair(1.0, 0.5),
                                           std::pair(6.0, 0.0), std::pair(20.0, 1.0)));

TEST(BoxSteps, HaveTheSameBitsOnEveryInstructionSet) {
  std::mt19937_64 random(8);
  const InstructionSet best = best_instruction_set();
  for (int k = 0; k < 20000; ++k) {
    const Scalar rate = k % 3 == 0 ? 0 : testing::random_magnitude(-3, 2, random);
    const RandomCase c = random_case(random, rate, k % 2 == 0 ? 0 : 1);
    const BoxSteps expected = steps_of(c, InstructionSet::Baseline);
    for (const InstructionSet set : {InstructionSet::Avx2, InstructionSet::Avx512}) {
      if (set > best) continue;
      const BoxSteps steps = steps_of(c, set);
      for (int column = 0; column < kWidth; ++column) {
        ASSERT_EQ(steps.time[column], expected.time[column]) << k;
      }
      ASSERT_EQ(steps.is_far, expected.is_far) << k;
    }
  }
}

TEST(BoxSteps, OfOneBoxHoldToo) {
  std::mt19937_64 random(9);
  for (int k = 0; k < 100; ++k) {
    const RandomCase c = random_case(random, 2, 0.1);
    const int column = k % kWidth;
    BoxSteps steps{};
    box_steps_kernels(best_instruction_set())
        .one(geometry_internal::rows_of(c.group, c.frame), column, 1, c.piece, c.motion, &steps);
    const Scalar time = steps.time[column];
    for (int i = 1; time > 0 && i <= 4; ++i) {
      ASSERT_GE(distance_at(c, column, std::min(time, c.motion.remaining) * i / 4),
                c.motion.floor - c.motion.noise);
    }
  }
}

TEST(BoxSteps, AreZeroWhereBoundsAreInfiniteOrUndefined) {
  std::mt19937_64 random(10);
  for (const Scalar bad : {kInfinity, std::nan("")}) {
    RandomCase c = random_case(random, 1, 0.1);
    c.motion.linear_acceleration = bad;
    c.motion.linear_speed = bad;
    const BoxSteps steps = steps_of(c);
    for (int column = 0; column < kWidth; ++column) EXPECT_EQ(steps.time[column], 0);
  }
}

}  // namespace
}  // namespace dyop::toi_internal
