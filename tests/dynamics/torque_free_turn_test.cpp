// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/free_flight.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/dynamics/world.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/world_scenes.h"

namespace dyop::dynamics_internal {
namespace {

using namespace testing;

Matrix3 cross_matrix(const Vector3& w) {
  Matrix3 W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return W;
}

// The oracle: R' = w x R with w = R J R^T L in world axes, by many steps of Runge and Kutta.
Matrix3 turned(const Matrix3& inverse_inertia_B, const Matrix3& R0, const Vector3& L_W, Scalar t,
               int steps) {
  const auto rate = [&](const Matrix3& R) {
    return Matrix3(cross_matrix(R * (inverse_inertia_B * (R.transpose() * L_W))) * R);
  };
  const Scalar h = t / steps;
  Matrix3 R = R0;
  for (int i = 0; i < steps; ++i) {
    const Matrix3 k1 = rate(R);
    const Matrix3 k2 = rate(R + h / 2 * k1);
    const Matrix3 k3 = rate(R + h / 2 * k2);
    const Matrix3 k4 = rate(R + h * k3);
    R += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return R;
}

TEST(TorqueFreeTurn, EqualsSmallStepsOfTheDefinitionAtAllScales) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<Scalar> uniform(0, 1);
  std::normal_distribution<Scalar> normal;
  for (int i = 0; i < 300; ++i) {
    // Sides of a box from needles to cubes, any axes, spins from slow to fast.
    const Vector3 sides_sq(std::pow(10, -3 * uniform(random)), std::pow(10, -uniform(random)), 1);
    const Vector3 moments(sides_sq.y() + sides_sq.z(), sides_sq.z() + sides_sq.x(),
                          sides_sq.x() + sides_sq.y());
    const Matrix3 Q = dyop::testing::random_rotation(random).toRotationMatrix();
    const Matrix3 J = Q * moments.cwiseInverse().asDiagonal() * Q.transpose();
    const Vector3 L = std::pow(10, 8 * uniform(random) - 4) *
                      Vector3(normal(random), normal(random), normal(random));
    const TorqueFreeTurn turn(J, L);
    const Scalar speed = J.norm() * L.norm();
    ASSERT_GT(turn.span() * speed, 0.05);  // an angle worth a series
    for (const Scalar part : {0.0, 0.3, 1.0}) {
      const Scalar t = part * turn.span();
      const TorqueFreeTurn::Turn now = turn.at(t);
      const Matrix3 R = turned(J, Matrix3::Identity(), L, t, 1000);
      EXPECT_LT((rotation_from_vector(now.theta) - R).norm(), 1e-12);
      EXPECT_LT((now.w_C - R * (J * (R.transpose() * L))).norm(), 1e-12 * speed);
    }
  }
}

TEST(TorqueFreeTurn, StaysWhereItIsWithoutSpin) {
  const TorqueFreeTurn turn(Matrix3::Identity(), Vector3::Zero());
  EXPECT_EQ(turn.span(), kInfinity);
  EXPECT_EQ(turn.at(1e6).theta.norm(), 0);
  EXPECT_EQ(turn.at(1e6).w_C.norm(), 0);
}

TEST(TorqueFreeTurn, CarriesATumblingBodyOfTheWorldToTheToleranceForAnyStep) {
  for (const Scalar h : {0.001, 0.01, 0.07, 0.5}) {
    World world(earth_options());
    const BodyDefinition body = dynamic_body("top", std::make_shared<Box>(Vector3(0.5, 0.3, 0.1)),
                                             {0, 0, 0}, {1, 2, 3}, {2, 3, -1});
    const BodyId top = world.add_body(body);
    const Matrix3& I = body.mass_properties.I_BBcm;
    const Vector3 L = I * Vector3(2, 3, -1);
    const Scalar energy = Vector3(2, 3, -1).dot(L) / 2;
    const Matrix3 J = I.inverse();
    Matrix3 R = Matrix3::Identity();
    const int count = static_cast<int>(std::round(3.5 / h));
    for (int i = 1; i <= count; ++i) {
      ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
      R = turned(J, R, L, h, 1 + static_cast<int>(h * 2000));
      const MotionState state = world.state(top);
      // A hundred million-th radian by the cubic, and what the oracle adds.
      ASSERT_LT((state.X_WB.rotation() - R).norm(), 1e-7);
      ASSERT_NEAR(state.twist.w_WB.dot(L) / 2 / energy, 1, 1e-7);
    }
    const Scalar t = h * count;
    const Vector3 g = earth_options().gravity_W;
    EXPECT_LT((world.state(top).X_WB.translation() - t * (Vector3(1, 2, 3) + t / 2 * g)).norm(),
              1e-10);
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
