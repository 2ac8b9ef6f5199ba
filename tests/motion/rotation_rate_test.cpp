// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "motion/curve/chart_curve.h"
#include "motion/motion_test_tools.h"

namespace dyop::testing {
namespace {

using Triple = std::array<long double, 3>;

Triple cross(const Triple& x, const Triple& y) {
  return {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
}

Triple as_triple(const Vector3& x) {
  return {static_cast<long double>(x.x()), static_cast<long double>(x.y()),
          static_cast<long double>(x.z())};
}

// The power series sum over k of ad^k theta' / (k+1)! in long double, which converges everywhere.
Vector3 series(const Vector3& theta, const Vector3& rate) {
  const Triple t = as_triple(theta);
  Triple term = as_triple(rate);
  Triple sum = term;
  for (int k = 1; k < 60; ++k) {
    term = cross(t, term);
    for (std::size_t i = 0; i < 3; ++i) {
      term[i] /= k + 1;
      sum[i] += term[i];
    }
  }
  return Vector3(static_cast<Scalar>(sum[0]), static_cast<Scalar>(sum[1]),
                 static_cast<Scalar>(sum[2]));
}

TEST(RotationRate, AngularVelocityMatchesTheSeriesAtAllAngles) {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const Scalar angle = 6 * std::pow(10.0, -10.0 * (i % 200) / 200);
    const Vector3 theta = angle * random.direction();
    const Vector3 rate = random.direction();
    EXPECT_LT((motion_internal::angular_velocity(theta, rate) - series(theta, rate)).norm(), 2e-15)
        << "angle " << angle;
  }
}

TEST(RotationRate, AngularVelocityIsContinuousWhereTheFormulaChanges) {
  const Vector3 axis = Vector3(1, 2, -2) / 3;
  const Vector3 rate(0.3, -0.9, 0.5);
  const Vector3 below = motion_internal::angular_velocity(0.5 * (1 - 1e-15) * axis, rate);
  const Vector3 above = motion_internal::angular_velocity(0.5 * (1 + 1e-15) * axis, rate);
  EXPECT_LT((below - above).norm(), 2e-15);
}

TEST(RotationRate, TheJacobianNeverStretches) {
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const Vector3 rate = random.direction();
    EXPECT_LE(motion_internal::angular_velocity(random.in_ball(40), rate).norm(), 1 + 1e-14);
  }
}

// At every size of theta, the change of formula at 1e-4 and zero included.
TEST(RotationRate, RotationVectorRateInvertsAngularVelocity) {
  Random random(3);
  for (int i = 0; i < 4000; ++i) {
    const Scalar size = std::pow(10.0, random.uniform(-8, 0));
    const Vector3 theta =
        i == 0 ? Vector3::Zero().eval()
               : Vector3(i % 2 == 0 ? random.in_ball(std::numbers::pi) : size * random.direction());
    const Vector3 rate = random.direction();
    const Vector3 w = motion_internal::angular_velocity(theta, rate);
    EXPECT_LT((motion_internal::rotation_vector_rate(theta, w) - rate).norm(), 3e-15)
        << theta.norm();
  }
}

// The part of the angular acceleration that comes from the Jacobian alone, theta'' = 0.
Scalar jacobian_acceleration(const Vector3& theta, const Vector3& rate) {
  return differentiate(
             [&](Scalar t) { return motion_internal::angular_velocity(theta + t * rate, rate); }, 0,
             1.0 / 64)
      .norm();
}

TEST(RotationRate, AccelerationBoundHoldsForAnyThetaAndRate) {
  Random random(4);
  for (int i = 0; i < 20000; ++i) {
    const Vector3 theta = std::pow(10.0, random.uniform(-3, 1.5)) * random.direction();
    const Vector3 rate = random.direction();
    const Scalar bound =
        motion_internal::angular_acceleration_bound(1, 0, theta.cross(rate).norm());
    EXPECT_LE(jacobian_acceleration(theta, rate), bound + 1e-11) << theta.norm();
  }
}

// Both constants are the best ones: 1/pi is reached at |theta| = pi with theta' perpendicular, and
// 1/6 in the limit of small angles.
TEST(RotationRate, AccelerationBoundIsReached) {
  const Vector3 x = Vector3::UnitX();
  const Vector3 y = Vector3::UnitY();
  EXPECT_NEAR(jacobian_acceleration(std::numbers::pi * x, y), 1 / std::numbers::pi, 1e-11);
  EXPECT_NEAR(jacobian_acceleration(0.01 * x, y), 0.01 / 6, 1e-6);
}

TEST(RotationRate, RoundingUpMakesInfinityOfNaN) {
  EXPECT_EQ(motion_internal::round_up(std::nan("")), kInfinity);
  EXPECT_GT(motion_internal::round_up(1), 1);
  EXPECT_EQ(motion_internal::round_up(0), 0);
}

}  // namespace
}  // namespace dyop::testing
