// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

TEST(SteadyTurn, IsTheExponentialOfTheRotationVector) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 20000; ++k) {
    const Matrix3 R0 = testing::random_rotation(random).toRotationMatrix();
    const Vector3 w = testing::random_magnitude(-12, 1, random) * testing::random_direction(random);
    const Scalar tau = testing::random_number(-2, 2, random);
    const Matrix3 R = SteadyTurn(R0, w).at(tau);
    EXPECT_LE((R - rotation_from_vector(tau * w) * R0).cwiseAbs().maxCoeff(),
              (16 + 4 * w.norm()) * kUnitRoundoff);
    EXPECT_LE((R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff(), 24 * kUnitRoundoff);
  }
}

TEST(SteadyTurn, StaysWhereItIsWithoutARate) {
  const Matrix3 R0 = rotation_from_vector(Vector3(1, 2, 3));
  EXPECT_EQ(SteadyTurn(R0, Vector3::Zero()).at(1e9), R0);
  EXPECT_EQ(SteadyTurn().at(5), Matrix3::Identity());
}

}  // namespace
}  // namespace dyop
