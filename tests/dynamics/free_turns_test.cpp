// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/free_turns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/core/rigid_pose.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/world_scenes.h"

namespace dyop::dynamics_internal {
namespace {

using namespace dyop::testing;

struct Spinning {
  Matrix3 inverse_inertia_B;
  Matrix3 R_WB;
  Vector3 L_W;
};

// Sides of a box from needles to cubes, any axes.
Spinning random_spinning(Scalar turning, std::mt19937_64& random) {
  const Vector3 sides_sq(random_magnitude(-3, 0, random), random_magnitude(-1, 0, random), 1);
  const Vector3 moments(sides_sq.y() + sides_sq.z(), sides_sq.z() + sides_sq.x(),
                        sides_sq.x() + sides_sq.y());
  const Matrix3 Q = random_rotation(random).toRotationMatrix();
  Spinning body;
  body.inverse_inertia_B = Q * moments.cwiseInverse().asDiagonal() * Q.transpose();
  body.R_WB = random_rotation(random).toRotationMatrix();
  body.L_W = turning * random_magnitude(-1, 1, random) * random_direction(random);
  return body;
}

Vector3 velocity(const Spinning& body, const Matrix3& R) {
  return R * (body.inverse_inertia_B * (R.transpose() * body.L_W));
}

// The oracle: small steps of the midpoint rule at a velocity that depends on R.
template <typename Velocity>
Matrix3 turned_in_steps(const Velocity& velocity_at, const Matrix3& R_WB, Scalar tau, int steps) {
  Matrix3 R = R_WB;
  for (int i = 0; i < steps; ++i) {
    const Scalar h = tau / steps;
    const Matrix3 middle = rotation_from_vector(h / 2 * velocity_at(R)) * R;
    R = rotation_from_vector(h * velocity_at(middle)) * R;
  }
  return R;
}

// Extrapolated.
template <typename Velocity>
Matrix3 turned(const Velocity& velocity_at, const Matrix3& R_WB, Scalar tau, int steps) {
  const Matrix3 coarse = turned_in_steps(velocity_at, R_WB, tau, steps);
  const Matrix3 fine = turned_in_steps(velocity_at, R_WB, tau, 2 * steps);
  return fine + (fine - coarse) / 3;
}

TEST(MeanFreeVelocity, TakesABodyWhereSmallStepsTakeIt) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    SCOPED_TRACE(i);
    // Turns from 1e-4 to 10 radians in times from 1e-4 to 1e4.
    const Scalar tau = random_magnitude(-4, 4, random);
    const Spinning body = random_spinning(random_magnitude(-4, 0, random) / tau, random);
    const Vector3 w_W = mean_free_velocity(body.inverse_inertia_B, body.R_WB, body.L_W, tau,
                                           velocity(body, body.R_WB));
    const Matrix3 end = rotation_from_vector(tau * w_W) * body.R_WB;
    const Scalar angle = tau * velocity(body, body.R_WB).norm();
    const int steps = 200 + static_cast<int>(2000 * std::min(angle, Scalar{10}));
    const Matrix3 exact =
        turned([&](const Matrix3& R) { return velocity(body, R); }, body.R_WB, tau, steps);
    EXPECT_LT((end - exact).norm(), 3e-6 * std::min(angle, Scalar{1}) + 1e-13);
    // It keeps its energy.
    const Scalar energy = body.L_W.dot(velocity(body, body.R_WB));
    EXPECT_NEAR(body.L_W.dot(velocity(body, end)), energy, 1e-4 * energy);
  }
}

// w without the locked components, so that the others of I w are those of L.
Vector3 locked_velocity(const BodyDefinition& body, const Matrix3& R, const Vector3& L_W) {
  const Matrix3 inertia_W = R * body.mass_properties.I_BBcm * R.transpose();
  Matrix3 A = Matrix3::Identity();
  Vector3 b = Vector3::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (body.locked.rotation[std::size_t(k)]) continue;
    A.row(k) = inertia_W.row(k);
    b[k] = L_W[k];
  }
  return A.fullPivLu().solve(b);
}

TEST(MeanLockedVelocity, TakesABodyWhereSmallStepsTakeIt) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    const Scalar tau = random_magnitude(-4, 4, random);
    const Vector3 sides(random_magnitude(-1, 0, random), random_magnitude(-1, 0, random), 1);
    BodyDefinition body = dynamic_body("box", std::make_shared<Box>(sides), Vector3::Zero());
    for (const int k : {i % 3, (i + i / 3) % 3}) body.locked.rotation[std::size_t(k)] = true;
    const Matrix3 R = random_rotation(random).toRotationMatrix();
    body.initial.X_WB = RigidPose(R, Vector3::Zero());
    const BodyRecord record = make_body_record(BodyId{0, 0}, body, 0);
    const Vector3 L_W = random_magnitude(-4, 0, random) / tau *
                        (body.mass_properties.I_BBcm * random_direction(random));
    const Vector3 w_W = locked_velocity(body, R, L_W);
    EXPECT_LT((record.angular_velocity(R, L_W) - w_W).norm(), 1e-9 * w_W.norm());
    const Vector3 mean_W = mean_locked_velocity(record, R, L_W, tau, w_W);
    const int steps = 200 + int(1000 * std::min(tau * w_W.norm(), Scalar{10}));
    const Matrix3 exact =
        turned([&](const Matrix3& at) { return locked_velocity(body, at, L_W); }, R, tau, steps);
    EXPECT_LT((rotation_from_vector(tau * mean_W) * R - exact).norm(),
              1e-5 * std::min(tau * w_W.norm(), Scalar{1}) + 1e-12);
  }
}

TEST(MeanFreeVelocity, IsTheNearestThatLeadsThere) {
  // About a principal axis, by many rounds.
  const Matrix3 mobility = Vector3(1, 2, 3).asDiagonal();
  for (const Scalar rounds : {0.4, 0.6, 1.3, 7.7, -3.2}) {
    const Vector3 L = 2 * std::numbers::pi * rounds / 2 * Vector3::UnitY();
    const Vector3 w = mean_free_velocity(mobility, Matrix3::Identity(), L, 1, mobility * L);
    EXPECT_LT((w - mobility * L).norm(), 1e-9) << rounds;
  }
  EXPECT_TRUE(mean_free_velocity(mobility, Matrix3::Identity(), Vector3::Zero(), 1, Vector3::Zero())
                  .isZero(0));
}

}  // namespace
}  // namespace dyop::dynamics_internal
