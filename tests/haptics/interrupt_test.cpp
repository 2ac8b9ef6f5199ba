// SPDX-License-Identifier: BSD-3-Clause

// What a deadline may cut off stops within a few pieces of work.

#include <gtest/gtest.h>

#include "distance/distance_traversal.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/batch_options.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

class Countdown final : public Interrupt {
 public:
  explicit Countdown(int asked) : left(asked) {}
  bool is_over() override { return left-- <= 0; }
  int left;
};

TEST(Interrupt, EndsADistanceWithNothingOrNotAtAll) {
  const TriangleMesh a = testing::icosphere(3).mesh(), b = testing::icosphere(3).mesh();
  const RigidPose X_WA, X_WB(Vector3(0.3, 0.2, 2.1));
  const DistanceResult whole = distance(a, X_WA, b, X_WB);
  int cut = 0;
  for (int asked = 0; asked < 200; ++asked) {
    DistanceCache cache;
    Countdown countdown(asked);
    const auto result = distance_internal::distance_until(a, X_WA, b, X_WB, {}, cache, countdown);
    cut += !result;
    if (!result) continue;
    EXPECT_EQ(result->lower, whole.lower);
    EXPECT_EQ(result->upper, whole.upper);
  }
  EXPECT_GT(cut, 0);
  EXPECT_LT(cut, 200);
}

TEST(Interrupt, EndsASearchForContactsWithNone) {
  const TriangleMesh a = testing::icosphere(3).mesh(), b = testing::icosphere(3).mesh();
  const RigidPose X_WA, X_WB(Vector3(0, 0, 2.05));
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  generate_contacts(a, X_WA, b, X_WB, 0.1, {}, workspace, contacts);
  const std::size_t whole = contacts.size();
  EXPECT_GT(whole, 0u);
  int cut = 0;
  for (int asked = 0; asked < 10'000; asked += 50) {
    Countdown countdown(asked);
    const bool is_through =
        generate_contacts(a, X_WA, b, X_WB, 0.1, {}, workspace, contacts, &countdown);
    EXPECT_EQ(contacts.size(), is_through ? whole : 0) << asked;
    cut += !is_through;
  }
  EXPECT_GT(cut, 0);
  EXPECT_LT(cut, 200);
}

// A block on a slope that it slides down.
TEST(Interrupt, EndsASolveWithTheBestSoFar) {
  ContactProblem block;
  block.bodies.resize(2);
  block.bodies[1].inverse_mass_W = Matrix3::Identity();
  block.bodies[1].inverse_inertia_W = Matrix3::Identity();
  block.bodies[1].free_v_W = Vector3(1, 0.2, -1);
  for (const Vector3& corner : {Vector3(1, 1, -1), Vector3(-1, 1, -1), Vector3(0, -1, -1)}) {
    PointContact contact;
    contact.body_a = 0;
    contact.body_b = 1;
    contact.r_b_W = corner;
    contact.nhat_AB_W = Vector3::UnitZ();
    contact.friction = 0.3;
    block.contacts.push_back(contact);
  }
  ContactCascade solver;
  ContactSolverOptions options;
  Countdown never(1 << 20);
  options.interrupt = &never;
  ContactProblem solved = block;
  EXPECT_EQ(solver.solve(solved, options).status, ContactStatus::Converged);
  Countdown at_once(0);
  options.interrupt = &at_once;
  const ContactReport report = solver.solve(block, options);
  EXPECT_EQ(report.status, ContactStatus::NotConverged);
  EXPECT_EQ(report.sweeps + report.newton_iterations + report.admm_iterations, 0);
  EXPECT_TRUE(block.bodies[1].v_W.allFinite());
}

}  // namespace
}  // namespace dyop
