// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "support/inputs/random_inputs.h"
#include "toi/deforming/pair_front.h"

namespace dyop {
namespace {

using toi_internal::ExpectedApproach;

// literal: far more than the rounding of numbers of size 10
constexpr Scalar kApproachNoise = 1e-12;

OrientedBox random_box(std::mt19937_64& random) {
  OrientedBox box;
  box.center = testing::random_vector(3, random);
  box.axes = rotation_from_vector(testing::random_vector(3, random));
  for (Scalar& half : box.half_extents) half = testing::random_number(0, 1, random);
  return box;
}

ExpectedApproach random_approach(std::mt19937_64& random) {
  ExpectedApproach approach;
  approach.least = testing::random_number(0, 1, random);
  approach.slack = testing::random_number(0, 0.2, random);
  approach.reach = 100;
  approach.v_W = testing::random_vector(1, random);
  approach.w_W = testing::random_vector(0.5, random);
  approach.origin_W = testing::random_vector(3, random);
  return approach;
}

// By how much a corner of the box comes nearer along n during the whole expected motion.
Scalar closing_of(const ExpectedApproach& approach, const OrientedBox& box, const Vector3& n_W,
                  int corner) {
  Vector3 side;
  for (int i = 0; i < 3; ++i) side[i] = (corner >> i & 1) == 0 ? -1 : 1;
  const Vector3 p_W = box.center + box.axes * box.half_extents.cwiseProduct(side);
  return -n_W.dot(approach.v_W + approach.w_W.cross(p_W - approach.origin_W));
}

// From the start to the end of the motion, which recedes in half of the cases, no corner is nearer
// than what is asked for, and one just reaches it.
TEST(ExpectedApproach, TheNeededGapIsUsedUpByTheCornerThatClosesMost) {
  std::mt19937_64 random(1);
  int receding = 0;
  for (int k = 0; k < 1000; ++k) {
    const ExpectedApproach approach = random_approach(random);
    const OrientedBox box = random_box(random);
    const Vector3 n_W = testing::random_direction(random);
    const Scalar gap = approach.needed_gap(n_W, box);
    Scalar least = kInfinity;
    for (int corner = 0; corner < 8; ++corner) {
      const Scalar at_end = gap - closing_of(approach, box, n_W, corner);
      least = std::min({least, gap, at_end});
      receding += corner == 0 && at_end > gap;
    }
    EXPECT_NEAR(least, approach.least + approach.slack, kApproachNoise) << k;
  }
  EXPECT_GT(receding, 300);
  EXPECT_LT(receding, 700);
}

// What is needed of a whole body bounds what is needed of its boxes, and is reached by a box that
// touches the ball around it where it closes in most.
TEST(ExpectedApproach, TheNeededGapOfABodyIsThatOfTheWorstBoxInIt) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 1000; ++k) {
    ExpectedApproach approach = random_approach(random);
    OrientedBox box = random_box(random);
    approach.radius = (box.center - approach.origin_W).norm() + box.half_extents.norm();
    const Vector3 n_W = testing::random_direction(random);
    EXPECT_GE(approach.needed_gap(n_W) + kApproachNoise, approach.needed_gap(n_W, box)) << k;
    EXPECT_GE(approach.largest_needed_gap() + kApproachNoise, approach.needed_gap(n_W)) << k;
    const Vector3 m_W = n_W.cross(approach.w_W).normalized();
    box.center = approach.origin_W - approach.radius * m_W;
    box.half_extents.setZero();
    EXPECT_NEAR(approach.needed_gap(n_W), approach.needed_gap(n_W, box), kApproachNoise) << k;
  }
}

TEST(ExpectedApproach, NothingBeyondItsReachMatters) {
  std::mt19937_64 random(2);
  ExpectedApproach approach = random_approach(random);
  approach.least = 0.5;
  approach.reach = 0.75;
  approach.v_W = Vector3(0, 0, -10);
  EXPECT_EQ(approach.needed_gap(Vector3::UnitZ(), random_box(random)), 0.75);
}

}  // namespace
}  // namespace dyop
