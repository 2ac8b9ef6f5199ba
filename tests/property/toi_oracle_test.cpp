// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/toi_oracle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

void expect_first_time(Scalar expected, const FirstApproach& found, Scalar resolution_in_time) {
  ASSERT_TRUE(found.t.has_value());
  EXPECT_LE(*found.t, expected + 1e-12);
  EXPECT_GE(*found.t, expected - resolution_in_time);
}

// Centers (-5, 1, 0) + (2, 0, 0) t and the origin, radii 1 and 0.5: d(t) = sqrt((2t - 5)^2 + 1) -
// 1.5, which is zero at t = (5 - sqrt(1.25)) / 2 and least, -0.5, at t = 2.5.
TEST(ToiOracle, TimesTwoSpheres) {
  const Sphere a(1);
  const Sphere b(0.5);
  const OracleBody body_a(a);
  const OracleBody body_b(b);
  const ConstantTwistMotion motion_a = moving(at(-5, 1, 0), {2, 0, 0});
  const RestMotion motion_b;
  ToiOracle oracle(body_a, motion_a, body_b, motion_b);
  const Scalar hit = (5 - std::sqrt(1.25)) / 2;
  expect_first_time(hit, oracle.first_time_within(0, {0, 4}, 1e-7), 1e-7);
  // At 0.5: (2t - 5)^2 = 3.
  expect_first_time((5 - std::sqrt(3)) / 2, oracle.first_time_within(0.5, {0, 4}, 1e-7), 1e-7);
  EXPECT_EQ(oracle.min_distance_on({0, 4}, 1e-3).upper, 0);
  // Spheres that pass: at the height 2 they leave 0.5.
  const ConstantTwistMotion passing = moving(at(-5, 2, 0), {2, 0, 0});
  ToiOracle miss(body_a, passing, body_b, motion_b);
  const MinimumDistance least = miss.min_distance_on({0, 4}, 1e-4);
  EXPECT_LE(least.lower, 0.5 + 1e-12);
  EXPECT_GE(least.upper, 0.5 - 1e-12);
  EXPECT_LE(least.upper - least.lower, 1e-4 + 1e-12);
  EXPECT_NEAR(least.t, 2.5, 0.02);
  EXPECT_FALSE(miss.first_time_within(0.49, {0, 4}, 1e-4).t.has_value());
  EXPECT_TRUE(miss.first_time_within(0.501, {0, 4}, 1e-4).t.has_value());
}

// Spheres that close a gap of 3 at speed 2: the distance is above 0.01 until t = 1.495.
TEST(ToiOracle, RefutesAClaimThatIsSlightlyTooLate) {
  const Sphere ball(1);
  const OracleBody body(ball);
  const ConstantTwistMotion closing = moving(at(-5, 0, 0), {2, 0, 0});
  const RestMotion resting;
  ToiOracle oracle(body, closing, body, resting);
  constexpr Scalar kResolution = 1e-6;
  EXPECT_FALSE(oracle.first_time_within(0.01 - kResolution, {0, 1.495}, kResolution).t.has_value());
  const FirstApproach found =
      oracle.first_time_within(0.01 - kResolution, {0, 1.495001}, kResolution);
  ASSERT_TRUE(found.t.has_value());
  EXPECT_LT(found.at_t.upper, 0.01);
}

// A rod of length 2 along z turns about the x axis at w: its tip is at (0, -2 sin wt, 2 cos wt),
// and the rod meets the point (0, -2 sin s, 2 cos s) * 0.7 at wt = s. Before, the distance is
// 1.4 sin(s - wt), as the foot lies on the rod.
TEST(ToiOracle, TimesARotatingRodAgainstAPoint) {
  const TriangleMesh rod = testing::needle(2, 3).mesh();
  const OracleBody body_a(rod);
  const Scalar w = 2;
  const Scalar s = 1.1;
  const testing::MeshArrays dot{{Vector3(0, -1.4 * std::sin(s), 1.4 * std::cos(s))}, {{0, 0, 0}}};
  const TriangleMesh point = dot.mesh();
  const OracleBody body_b(point);
  const ConstantTwistMotion turning = moving(RigidPose(), {0, 0, 0}, {w, 0, 0});
  const RestMotion resting;
  ToiOracle oracle(body_a, turning, body_b, resting);
  // At a distance of 0.1 the closing speed is 1.4 w cos(s - wt), above 2.
  const FirstApproach found = oracle.first_time_within(0.1, {0, 3}, 1e-8);
  expect_first_time((s - std::asin(0.1 / 1.4)) / w, found, 1e-8);
  const FirstApproach contact = oracle.first_time_within(0, {0, 3}, 1e-8);
  expect_first_time(s / w, contact, 1e-8);
  EXPECT_EQ(oracle.min_distance_on({0, 3}, 1e-5).lower, 0);
  const MinimumDistance before = oracle.min_distance_on({0, 0.5}, 1e-5);
  EXPECT_LE(before.lower, 1.4 * std::sin(s - 1) + 1e-12);
  EXPECT_GE(before.upper, 1.4 * std::sin(s - 1) - 1e-12);
  EXPECT_LE(before.upper - before.lower, 1e-5 + 1e-12);
}

// A cube of half width 1 falls at speed 3 from a height of 4 (lower face at 3) on a plate.
TEST(ToiOracle, TimesABoxDroppedOnAPlane) {
  const TriangleMesh plate = testing::plate_grid(10, 10, 8, 8).mesh();
  const TriangleMesh cube = testing::box_mesh(Vector3(1, 1, 1)).mesh();
  const Box solid(Vector3(1, 1, 1));
  for (const Shape* falling :
       {static_cast<const Shape*>(&cube), static_cast<const Shape*>(&solid)}) {
    const OracleBody body_a(*falling);
    const OracleBody body_b(plate);
    const ConstantTwistMotion motion_a = moving(at(0.1, 0.2, 4), {0, 0, -3});
    const RestMotion resting;
    ToiOracle oracle(body_a, motion_a, body_b, resting);
    expect_first_time(1, oracle.first_time_within(0, {0, 2}, 1e-7), 1e-7);
    const MinimumDistance least = oracle.min_distance_on({0, 0.9}, 1e-6);
    EXPECT_NEAR(least.upper, 0.3, 1e-6);
    EXPECT_EQ(least.t, 0.9);
  }
}

TEST(ToiOracle, SeesContainmentAtTheStart) {
  const Box large(Vector3(5, 5, 5));
  const Sphere small(1);
  const OracleBody body_a(large);
  const OracleBody body_b(small);
  const RestMotion resting;
  ToiOracle oracle(body_a, resting, body_b, resting);
  EXPECT_EQ(oracle.distance_at(0).upper, 0);
  EXPECT_EQ(oracle.min_distance_on({0, 1}, 0.1).upper, 0);
  EXPECT_EQ(oracle.first_time_within(0, {0, 1}, 0.1).t, 0);
}

// The two certified answers against each other and against plain dense sampling.
TEST(ToiOracle, IsConsistentOnRandomMotions) {
  std::mt19937_64 random(21);
  const TriangleMesh ring = testing::torus(1, 0.3, 16, 8).mesh();
  const TriangleMesh ball = testing::icosphere(2, 0.5).mesh();
  const OracleBody body_a(ring);
  const OracleBody body_b(ball);
  constexpr Scalar kResolution = 1e-3;
  int hits = 0;
  constexpr int kCases = 16;
  for (int k = 0; k < kCases; ++k) {
    const ConstantTwistMotion motion_a(random_pose(0.5, random), random_twist(1, 6, random));
    const Vector3 start = 3 * random_direction(random);
    const Vector3 aim = random_vector(2.5, random) - start;
    const ConstantTwistMotion motion_b(RigidPose(random_rotation(random), start),
                                       Twist{aim, 6 * random_direction(random)});
    ToiOracle oracle(body_a, motion_a, body_b, motion_b);
    const TimeInterval interval{0, 1};
    const FirstApproach first = oracle.first_time_within(0.1, interval, kResolution);
    const MinimumDistance least = oracle.min_distance_on(interval, kResolution);
    EXPECT_LE(least.upper - least.lower, kResolution + 1e-12);
    if (first.t) {
      ++hits;
      EXPECT_LE(first.at_t.upper, 0.1 + kResolution);
      EXPECT_LE(least.lower, 0.1 + kResolution);
      EXPECT_GE(oracle.min_distance_on({0, *first.t}, kResolution).upper, 0.1);
    } else {
      EXPECT_GE(least.upper, 0.1);
    }
    for (int s = 0; s <= 200; ++s) {
      const Scalar t = s / 200.0;
      const DistanceBracket d = oracle.distance_at(t);
      EXPECT_GE(d.upper, least.lower);
      EXPECT_TRUE(d.upper >= 0.1 - 1e-12 || (first.t && t >= *first.t));
    }
  }
  EXPECT_GE(hits, kCases / 4);
  EXPECT_LE(hits, kCases - kCases / 4);
}

TEST(ToiOracle, RefusesAResolutionOfZero) {
  const Sphere ball(1);
  const OracleBody body(ball);
  const RestMotion resting;
  ToiOracle oracle(body, resting, body, resting);
  EXPECT_THROW(oracle.min_distance_on({0, 1}, 0), InvalidArgument);
  EXPECT_THROW(oracle.first_time_within(0, {0, 1}, 0), InvalidArgument);
}

}  // namespace
}  // namespace dyop::testing
