// SPDX-License-Identifier: BSD-3-Clause

// More contacts than a body needs, which ask for velocities that contradict one another by little:
// gaps differ by rounding and by what earlier solves left. Some contacts must let go, and all of
// their load has to move to the others.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/contact/contact_solver.h"
#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_oracle.h"

namespace dyop::testing {
namespace {

constexpr Scalar kTolerance = 1e-9;

// A block on the plane z = 0 with `count` corners, turned and at rest but for a step of gravity.
ContactProblem resting_prism(int count, Scalar friction, std::mt19937_64& random) {
  ContactProblem problem;
  problem.bodies = {ContactBody{},
                    box_body(Vector3(0.5, 0.6, 0.4), random_number(0.1, 10, random),
                             random_rotation(random).toRotationMatrix(), Vector3(0, 0, -0.0981))};
  const Scalar turn = random_number(0, 1, random);
  for (int i = 0; i < count; ++i) {
    const Scalar angle = turn + 2 * std::numbers::pi * i / count;
    PointContact& contact = problem.contacts.emplace_back();
    contact.body_b = 1;
    contact.r_b_W = Vector3(0.3 * std::cos(angle), 0.3 * std::sin(angle), -0.25);
    contact.nhat_AB_W = Vector3::UnitZ();
    contact.friction = friction;
  }
  return problem;
}

// Solves twice: as it is, and from there with targets that differ by so many tolerances. Returns
// the second report.
ContactReport solve_disturbed(ContactSolver& solver, ContactProblem& problem, Scalar tolerances,
                              std::mt19937_64& random) {
  ContactSolverOptions options;
  options.tolerance = kTolerance;
  EXPECT_EQ(solver.solve(problem, options).status, ContactStatus::Converged);
  for (PointContact& contact : problem.contacts) {
    contact.target = random_number(-tolerances, tolerances, random) * kTolerance;
  }
  const ContactReport report = solver.solve(problem, options);
  EXPECT_EQ(broken_contact_law(problem, report.residual * 1.001 + 1e-13), "");
  return report;
}

TEST(RedundantContacts, LetGoWhereTheyContradictOneAnother) {
  std::mt19937_64 random(61);
  ContactCascade cascade;
  int factorisations = 0;
  int solves = 0;
  for (const Scalar tolerances : {2, 5, 20, 100, 1000, 100000}) {
    for (int count = 3; count <= 9; ++count) {
      for (int k = 0; k < 10; ++k) {
        ContactProblem problem = resting_prism(count, random_number(0.1, 1, random), random);
        const ContactReport report = solve_disturbed(cascade, problem, tolerances, random);
        EXPECT_EQ(report.status, ContactStatus::Converged)
            << count << " contacts, targets differ by " << tolerances << " tolerances, residual "
            << report.residual;
        factorisations += report.newton_iterations;
        ++solves;
      }
    }
  }
  EXPECT_LE(factorisations, 12 * solves);  // recorded: 8.5 on average
}

// Between two walls that both ask it to come away from them: no impulses solve that, however large.
// Without friction nothing bounds them, and beside huge ones what is missing vanishes in rounding.
TEST(RedundantContacts, ThatPushAgainstEachOtherAreNotSolvedByHugeImpulses) {
  std::mt19937_64 random(62);
  ContactCascade cascade;
  for (int k = 0; k < 60; ++k) {
    ContactProblem problem;
    const int boxes = 1 + k % 4;
    problem.bodies = {ContactBody{}};
    for (int i = 0; i < boxes; ++i) {
      problem.bodies.push_back(box_body(Vector3(0.5, 0.5, 0.5), random_number(0.1, 10, random),
                                        Matrix3::Identity(), Vector3(0, 0, -0.0981)));
    }
    const Scalar target = std::pow(10, random_number(-6, 0, random));
    for (int i = 0; i <= boxes; ++i) {
      for (const Scalar y : {-0.5, 0.5}) {
        for (const Scalar z : {-0.5, 0.5}) {
          PointContact& contact = problem.contacts.emplace_back();
          contact.body_a = std::size_t(i);
          contact.body_b = std::size_t((i + 1) % (boxes + 1));
          contact.r_a_W = Vector3(i == 0 ? 0 : 0.5, y, z);
          contact.r_b_W = Vector3(i == boxes ? 0 : -0.5, y, z);
          contact.nhat_AB_W = Vector3::UnitX();
          contact.friction = k % 3 == 0 ? 0 : random_number(0, 1, random);
          contact.target = target;
        }
      }
    }
    const ContactReport report = cascade.solve(problem, {.tolerance = 1e-6 * target});
    EXPECT_EQ(report.status, ContactStatus::NotConverged) << k;
    EXPECT_GT(report.residual, 0.01 * target) << k;
  }
}

}  // namespace
}  // namespace dyop::testing
