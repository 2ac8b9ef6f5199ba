// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/interior_point_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "dyop/contact/contact_solver.h"
#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_oracle.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::arch_scene;
using dyop::testing::broken_contact_law;
using dyop::testing::pile_scene;
using dyop::testing::random_direction;
using dyop::testing::random_index;
using dyop::testing::random_number;
using dyop::testing::random_vector;
using dyop::testing::stack_scene;
using dyop::testing::wall_scene;

constexpr Scalar kTolerance = 1e-9;

ContactReport improve(ContactProblem& problem, Scalar tolerance,
                      InteriorPointSolver::Sliding sliding) {
  ContactSystem system;
  system.build(problem);
  InteriorPointSolver solver;
  ContactReport report;
  ContactSolverOptions options;
  options.tolerance = tolerance;
  solver.improve(system, options, report, sliding);
  report.residual = system.residual();
  system.write(problem);
  return report;
}

ContactReport rest(ContactProblem& problem, Scalar tolerance = kTolerance) {
  return improve(problem, tolerance, InteriorPointSolver::Sliding::None);
}

// From nothing, in hardly more factorisations for a pile than for a stack. Recorded: 6 to 14.
TEST(InteriorPointSolver, HoldsWhatStands) {
  int scene = 0;
  for (ContactProblem problem :
       {stack_scene(10), stack_scene(10, 0), arch_scene(25), arch_scene(101), pile_scene(5, 5)}) {
    SCOPED_TRACE("scene " + std::to_string(scene++));
    ContactProblem by_newton = problem;
    const ContactReport report = rest(problem);
    EXPECT_LE(report.residual, kTolerance);
    EXPECT_LE(report.newton_iterations, 16);
    EXPECT_EQ(broken_contact_law(problem, 1.001 * kTolerance), "");
    ContactSolverOptions options;
    options.tolerance = kTolerance;
    options.newton_limit = 1000;
    NewtonSolver newton;
    EXPECT_EQ(newton.solve(by_newton, options).status, ContactStatus::Converged);
    for (std::size_t i = 0; i < by_newton.bodies.size(); ++i) {
      const ContactBody& body = problem.bodies[i];
      EXPECT_LE((body.v_W - by_newton.bodies[i].v_W).norm(), 1e-6) << "body " << i;
      EXPECT_LE((body.w_W - by_newton.bodies[i].w_W).norm(), 1e-5) << "body " << i;
    }
  }
}

// What rests needs no friction against turning, and where every contact presses it bears some that
// it had before.
TEST(InteriorPointSolver, HoldsWhatStandsWithFrictionAgainstTurning) {
  for (const bool is_pile : {false, true}) {
    for (const Scalar before : {0.0, is_pile ? 0.0 : 1e-4}) {
      ContactProblem problem = is_pile ? pile_scene(5, 5) : stack_scene(10);
      for (PointContact& contact : problem.contacts) {
        contact.rolling_friction = 0.01;
        contact.torsional_friction = 0.005;
        contact.impulse_W = contact.nhat_AB_W;
        contact.angular_impulse_W = Vector3::Constant(before);
      }
      const ContactReport report = rest(problem);
      EXPECT_LE(report.residual, kTolerance) << before;
      EXPECT_LE(report.newton_iterations, 16);
      EXPECT_LE(dyop::testing::contact_residual(problem), 1.001 * kTolerance);
      EXPECT_LE(dyop::testing::momentum_error(problem), 1e-12);
    }
  }
}

// The same problem with lengths so many times as large, and densities as they were.
ContactProblem in_other_units(ContactProblem problem, Scalar length) {
  const Scalar mass = length * length * length;
  for (ContactBody& body : problem.bodies) {
    body.inverse_mass_W /= mass;
    body.inverse_inertia_W /= mass * length * length;
    body.free_v_W *= length;
  }
  for (PointContact& contact : problem.contacts) {
    contact.r_a_W *= length;
    contact.r_b_W *= length;
    contact.target *= length;
  }
  return problem;
}

TEST(InteriorPointSolver, DoesNotDependOnTheUnits) {
  for (const ContactProblem& scene : {arch_scene(25), pile_scene(5, 5)}) {
    ContactProblem problem = scene;
    const int iterations = rest(problem).newton_iterations;
    for (const Scalar length : {1e-4, 1e4}) {
      problem = in_other_units(scene, length);
      const ContactReport report = rest(problem, kTolerance * length);
      EXPECT_LE(report.residual, kTolerance * length);
      EXPECT_NEAR(report.newton_iterations, iterations, 1) << length;
    }
  }
}

// What slides is noticed within a few factorisations, and the impulses are those of before.
TEST(InteriorPointSolver, GivesUpWhereSomethingSlides) {
  ContactProblem problem = wall_scene(20, 10);
  for (ContactBody& body : problem.bodies) {
    if (!body.inverse_mass_W.isZero(0)) body.free_v_W += Vector3(0, 1, 0);
  }
  for (PointContact& contact : problem.contacts) {
    contact.impulse_W = 0.01 * contact.nhat_AB_W;
  }
  const ContactProblem before = problem;
  const ContactReport report = rest(problem);
  EXPECT_GT(report.residual, kTolerance);
  EXPECT_LE(report.newton_iterations, 12);
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    EXPECT_LE((problem.contacts[i].impulse_W - before.contacts[i].impulse_W).norm(), 1e-15);
  }
}

JointRow& add_row(ContactProblem& problem, std::size_t a, std::size_t b, const Vector3& axis_W) {
  JointRow& row = problem.rows.emplace_back();
  row.body_a = a;
  row.body_b = b;
  row.j_av_W = -axis_W;
  row.j_bv_W = axis_W;
  return row;
}

// Two of a stack's boxes are tied to each other, twice along one axis; a motor, whose impulse has
// bounds, pushes the uppermost one to the side by less than friction holds, and a limit, which may
// only push, is far away.
TEST(InteriorPointSolver, HoldsWhatJointsTie) {
  ContactProblem problem = stack_scene(10);
  const std::size_t top = problem.bodies.size() - 1;
  for (const Vector3& axis_W : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 1, 0)}) {
    add_row(problem, top - 2, top - 1, axis_W);
  }
  JointRow& motor = add_row(problem, top - 1, top, Vector3(1, 0, 0));
  motor.target = 100;
  motor.upper = 1e-3;
  motor.lower = -1e-3;
  JointRow& limit = add_row(problem, top - 3, top, Vector3(0, 0, 1));
  limit.target = -10;
  limit.lower = 0;
  const ContactReport report = rest(problem);
  EXPECT_LE(report.residual, kTolerance);
  EXPECT_LE(report.newton_iterations, 16);
  EXPECT_EQ(broken_contact_law(problem, 1.001 * kTolerance), "");
  EXPECT_NEAR(problem.rows[3].impulse, 1e-3, 1e-9);
  EXPECT_NEAR(problem.rows[4].impulse, 0, 1e-9);
}

// Rows between any two of a stack's boxes along any axes, in any units: equations, limits, and
// motors too weak to push a box to the side.
void add_random_rows(ContactProblem& problem, Scalar weight, std::mt19937_64& random) {
  const int count = static_cast<int>(problem.bodies.size());
  for (int k = 0; k < 8; ++k) {
    const int a = 1 + random_index(count - 1, random);
    const int b = 1 + random_index(count - 1, random);
    if (a == b) continue;
    JointRow& row = add_row(problem, std::size_t(a), std::size_t(b), random_direction(random));
    if (k % 3 == 1) row.lower = 0;
    if (k % 3 != 2) continue;
    row.target = random_number(-1, 1, random);
    row.upper = 0.01 * weight * random_number(0, 1, random);
    row.lower = -0.01 * weight * random_number(0, 1, random);
  }
}

TEST(InteriorPointSolver, KeepsTheLawsOfRandomRows) {
  std::mt19937_64 random(31);
  int solved = 0;
  constexpr int kProblems = 400;
  for (int i = 0; i < kProblems; ++i) {
    SCOPED_TRACE(i);
    ContactProblem problem = stack_scene(6);
    const Scalar weight =
        problem.bodies.back().free_v_W.norm() * 3 / problem.bodies.back().inverse_mass_W.trace();
    add_random_rows(problem, weight, random);
    const Scalar length = std::pow(10, i % 5 * 2 - 4);
    problem = in_other_units(problem, length);
    for (JointRow& row : problem.rows) {
      row.target *= length;
      row.lower *= std::pow(length, 4);
      row.upper *= std::pow(length, 4);
    }
    const ContactReport report = rest(problem, kTolerance * length);
    for (const JointRow& row : problem.rows) {
      EXPECT_GE(row.impulse, row.lower);
      EXPECT_LE(row.impulse, row.upper);
    }
    if (report.residual > kTolerance * length) continue;
    ++solved;
    EXPECT_EQ(broken_contact_law(problem, 1.001 * kTolerance * length), "");
  }
  EXPECT_GT(solved, kProblems * 9 / 10);
}

// Rows between any two bodies: equations, limits, and motors that may be too weak.
void tie_at_random(ContactProblem& problem, std::mt19937_64& random) {
  const int count = int(problem.bodies.size());
  for (int k = 0; k < count; ++k) {
    const int a = random_index(count, random), b = random_index(count, random);
    if (a == b) continue;
    JointRow& row = add_row(problem, std::size_t(a), std::size_t(b), random_direction(random));
    row.j_bw_W = random_vector(1, random);
    if (k % 3 == 1) row.lower = 0;
    if (k % 3 != 2) continue;
    row.target = random_number(-1, 1, random);
    row.upper = random_number(0, 1, random);
    row.lower = -random_number(0, 1, random);
  }
}

int sliding_contacts(const ContactProblem& problem) {
  int count = 0;
  for (const PointContact& contact : problem.contacts) {
    const Scalar normal = contact.nhat_AB_W.dot(contact.impulse_W);
    const Scalar tangential = (contact.impulse_W - normal * contact.nhat_AB_W).norm();
    count += normal > 1e-3 && tangential > (1 - 1e-6) * contact.friction * normal;
  }
  return count;
}

// Bodies thrown at random, tied by rows, in units from 1e-4 to 1e4, most of which slide: the laws hold,
// as an oracle says that shares no code. Recorded: 399 of 400, by 16 factorisations each.
TEST(InteriorPointSolver, SolvesWhatSlides) {
  std::mt19937_64 random(33);
  int solved = 0, sliding = 0, factorisations = 0;
  constexpr int kProblems = 400;
  for (int i = 0; i < kProblems; ++i) {
    SCOPED_TRACE(i);
    testing::RandomContacts wanted;
    wanted.bodies = 1 + random_index(8, random);
    wanted.contacts = 2 * wanted.bodies;
    ContactProblem problem = testing::random_contact_problem(wanted, random);
    tie_at_random(problem, random);
    const Scalar length = std::pow(10, i % 5 * 2 - 4);
    problem = in_other_units(problem, length);
    for (JointRow& row : problem.rows) {
      row.j_bw_W *= length;
      row.target *= length;
      row.lower *= std::pow(length, 4);
      row.upper *= std::pow(length, 4);
    }
    const Scalar tolerance = kTolerance * length;
    const ContactReport report = improve(problem, tolerance, InteriorPointSolver::Sliding::Any);
    factorisations += report.newton_iterations;
    EXPECT_LE(dyop::testing::momentum_error(problem), 1e-9);
    if (report.residual > tolerance) continue;
    ++solved;
    sliding += sliding_contacts(problem) > 0;
    EXPECT_LE(dyop::testing::contact_residual(problem), 1.001 * tolerance);
    EXPECT_EQ(broken_contact_law(problem, 1.001 * tolerance), "");
  }
  EXPECT_GT(solved, kProblems * 9 / 10);
  EXPECT_GT(sliding, kProblems / 2);
  EXPECT_LE(factorisations, 20 * kProblems);
}

}  // namespace
}  // namespace dyop::contact_internal
