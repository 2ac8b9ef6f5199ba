// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/loads/load_sharing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

// A body that slides along x on a floor and touches it at these places, with these loads.
ContactProblem sliding_on(const std::vector<Vector3>& places, const std::vector<Scalar>& loads,
                          const Matrix3& R) {
  ContactProblem problem;
  problem.bodies.resize(2);
  problem.bodies[1].v_W = R * Vector3::UnitX();
  for (std::size_t k = 0; k < places.size(); ++k) {
    PointContact contact;
    contact.body_b = 1;
    contact.r_b_W = R * places[k];
    contact.nhat_AB_W = R * Vector3::UnitZ();
    contact.friction = 0.5;
    contact.impulse_W = R * Vector3(-0.5 * loads[k], 0, loads[k]);
    problem.contacts.push_back(contact);
  }
  return problem;
}

const std::vector<Vector3> kCorners{{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}};

TEST(LoadSharing, FourCornersGetAsMuch) {
  const ContactProblem problem = sliding_on(kCorners, {2, 0, 2, 0}, Matrix3::Identity());
  for (const Vector3& impulse : internal::shared_loads(problem, 1e-6)) {
    EXPECT_LT((impulse - Vector3(-0.5, 0, 1)).norm(), 1e-12);
  }
}

TEST(LoadSharing, KeepsForceAndTorqueAndLetsNothingPull) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  for (int trial = 0; trial < 10'000; ++trial) {
    const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
    std::vector<Vector3> places;
    std::vector<Scalar> loads;
    const int count = 3 + trial % 6;
    const bool is_line = trial % 5 == 0;
    for (int k = 0; k < count; ++k) {
      places.emplace_back(uniform(random), is_line ? 0.3 : uniform(random), 0);
      loads.push_back(std::max(uniform(random), 0.0));
    }
    const ContactProblem problem = sliding_on(places, loads, R);
    const std::vector<Vector3> shared = internal::shared_loads(problem, 1e-6);
    Vector3 change = Vector3::Zero(), torque_change = Vector3::Zero();
    for (std::size_t k = 0; k < shared.size(); ++k) {
      const PointContact& contact = problem.contacts[k];
      const Scalar load = contact.nhat_AB_W.dot(shared[k]);
      EXPECT_GT(load, -1e-12);
      EXPECT_LT((shared[k] - load * (contact.nhat_AB_W - 0.5 * R.col(0))).norm(), 1e-12);
      change += shared[k] - contact.impulse_W;
      torque_change += contact.r_b_W.cross(shared[k] - contact.impulse_W);
    }
    EXPECT_LT(change.norm(), 1e-11);
    EXPECT_LT(torque_change.norm(), 1e-9);
    // Sharing again changes nothing where no load was at its limit.
    if (*std::min_element(loads.begin(), loads.end()) > 0) {
      ContactProblem again = problem;
      for (std::size_t k = 0; k < shared.size(); ++k) again.contacts[k].impulse_W = shared[k];
      const std::vector<Vector3> twice = internal::shared_loads(again, 1e-6);
      for (std::size_t k = 0; k < shared.size(); ++k)
        EXPECT_LT((twice[k] - shared[k]).norm(), 1e-9);
    }
  }
}

TEST(LoadSharing, LeavesAloneWhatRestsAndWhatIsOpen) {
  ContactProblem resting = sliding_on(kCorners, {2, 0, 2, 0}, Matrix3::Identity());
  resting.bodies[1].v_W.setZero();
  const std::vector<Vector3> same = internal::shared_loads(resting, 1e-6);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(same[k], resting.contacts[k].impulse_W);

  ContactProblem open = sliding_on(kCorners, {1, 2, 3, 0}, Matrix3::Identity());
  open.contacts[3].target = -1;  // opens, compared with it
  const std::vector<Vector3> three = internal::shared_loads(open, 1e-6);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_LT((three[k] - open.contacts[k].impulse_W).norm(), 1e-12);
  }
}

// One corner sticks, and needs its load for its friction.
TEST(LoadSharing, LeavesWhatSticksItsFriction) {
  ContactProblem problem = sliding_on(kCorners, {3, 1, 3, 1}, Matrix3::Identity());
  problem.contacts[0].impulse_W = Vector3(-1.4, 0, 3);
  const std::vector<Vector3> shared = internal::shared_loads(problem, 1e-6);
  EXPECT_NEAR(shared[0].z(), 2.8, 1e-12);
  EXPECT_EQ(shared[0].x(), -1.4);
  EXPECT_NEAR(shared[1].z(), 1.2, 1e-12);
}

}  // namespace
}  // namespace dyop
