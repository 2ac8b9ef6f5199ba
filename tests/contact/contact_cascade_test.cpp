// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "dyop/contact/contact_solver.h"
#include "dyop/core/error.h"
#include "support/inputs/contact_scenes.h"
#include "support/oracles/contact_oracle.h"

namespace dyop::testing {
namespace {

struct Scene {
  const char* name;
  ContactProblem problem;
  int newton_limit;  // recorded: factorisations that it took, with some to spare
};

std::vector<Scene> scenes() {
  return {{"stack of 10", stack_scene(10), 12},
          {"arch of 25", arch_scene(25), 15},
          {"arch of 101", arch_scene(101), 24},
          {"pile of 4 x 4 x 4", pile_scene(4, 4), 15},
          {"pile of 5 x 5 x 5", pile_scene(5, 5), 15}};
}

// What stands keeps standing: all velocities vanish, at the first step and from there on with the
// warm start of the last.
TEST(ContactCascade, HoldsStacksArchesAndPiles) {
  for (Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    ContactCascade cascade;
    ContactSolverOptions options;
    options.tolerance = 1e-8;
    const ContactReport first = cascade.solve(scene.problem, options);
    EXPECT_EQ(first.status, ContactStatus::Converged) << first.residual;
    EXPECT_LE(first.newton_iterations, scene.newton_limit);
    EXPECT_EQ(broken_contact_law(scene.problem, 1.001e-8), "");
    for (const ContactBody& body : scene.problem.bodies) {
      EXPECT_LE(body.v_W.norm() + body.w_W.norm(), 1e-5);
    }
    const ContactReport second = cascade.solve(scene.problem, options);
    EXPECT_EQ(second.status, ContactStatus::Converged);
    EXPECT_EQ(second.newton_iterations + second.sweeps + second.admm_iterations, 0);
  }
}

// Gauss-Seidel ends with the first sweep that is exact enough: one less is not.
TEST(GaussSeidel, SweepsNoLongerThanItsToleranceAsks) {
  for (const Scalar tolerance : {1e-2, 1e-3, 1e-4}) {
    const ContactProblem problem = pile_scene(4, 4);
    ContactSolverOptions options;
    options.tolerance = tolerance;
    options.sweep_limit = 1000;
    GaussSeidelSolver solver;
    ContactProblem solved = problem;
    const ContactReport report = solver.solve(solved, options);
    EXPECT_EQ(report.status, ContactStatus::Converged) << report.residual;
    EXPECT_EQ(broken_contact_law(solved, 1.001 * tolerance), "");
    ASSERT_GT(report.sweeps, 1);
    options.sweep_limit = report.sweeps - 1;
    ContactProblem unsolved = problem;
    EXPECT_EQ(solver.solve(unsolved, options).status, ContactStatus::NotConverged) << tolerance;
  }
}

// A weight of a million times the masses below it is carried without sinking in.
TEST(ContactCascade, CarriesLargeMassRatios) {
  ContactProblem problem = stack_scene(5);
  problem.bodies.back().inverse_mass_W *= 1e-6;
  problem.bodies.back().inverse_inertia_W *= 1e-6;
  ContactCascade cascade;
  ContactSolverOptions options;
  options.tolerance = 1e-8;
  const ContactReport report = cascade.solve(problem, options);
  EXPECT_EQ(report.status, ContactStatus::Converged) << report.residual;
  EXPECT_LE(problem.bodies.back().v_W.norm(), 1e-6);
}

TEST(ContactCascade, SolvesPainlevesRod) {
  const Matrix3 R = Eigen::AngleAxisd(1, Vector3::UnitY()).toRotationMatrix();
  ContactProblem problem;
  problem.bodies = {ContactBody{}, box_body(Vector3(2, 0.01, 0.01), 1, R, Vector3(3, 0, -0.1))};
  PointContact& contact = problem.contacts.emplace_back();
  contact.body_b = 1;
  contact.r_b_W = R * Vector3(1, 0, 0);
  contact.nhat_AB_W = Vector3::UnitZ();
  contact.friction = 3;
  ContactCascade cascade;
  EXPECT_EQ(cascade.solve(problem).status, ContactStatus::Converged);
}

// Without any budget the answer is the warm start, and the report says how bad that is.
TEST(ContactCascade, SaysThatItDidNotConverge) {
  ContactProblem problem = stack_scene(3);
  ContactCascade cascade;
  ContactSolverOptions options;
  options.sweep_limit = options.few_sweep_limit = options.newton_limit = options.admm_limit = 0;
  const ContactReport report = cascade.solve(problem, options);
  EXPECT_EQ(report.status, ContactStatus::NotConverged);
  EXPECT_NEAR(report.residual, contact_residual(problem), 1e-12);
  EXPECT_NEAR(report.residual, 0.0981, 1e-12);
}

// Out of patience, Newton and ADMM end where going on to the limit brings next to nothing; what
// converges does not notice.
TEST(ContactCascade, GivesUpWhatDoesNotGetBetter) {
  ContactSolverOptions patient;
  patient.tolerance = 1e-8;
  ContactSolverOptions impatient = patient;
  impatient.patience = 10;
  patient.cascade_rounds = impatient.cascade_rounds = 1;
  patient.restart_contacts = impatient.restart_contacts = 0;
  ContactCascade cascade;
  ContactProblem squeezed = stack_scene(3);  // must rise off its floor and off its ceiling
  squeezed.bodies.emplace_back();
  PointContact& ceiling = squeezed.contacts.emplace_back(squeezed.contacts.back());
  ceiling.body_a = squeezed.bodies.size() - 2;
  ceiling.body_b = squeezed.bodies.size() - 1;
  ceiling.target = 1;
  for (PointContact& contact : squeezed.contacts) contact.target = 1;
  ContactProblem again = squeezed;
  const ContactReport long_run = cascade.solve(squeezed, patient);
  const ContactReport short_run = cascade.solve(again, impatient);
  EXPECT_EQ(long_run.status, ContactStatus::NotConverged);
  EXPECT_EQ(short_run.status, ContactStatus::NotConverged);
  EXPECT_NEAR(short_run.residual, contact_residual(again), 1e-12);
  EXPECT_LE(2 * short_run.newton_iterations, long_run.newton_iterations);
  EXPECT_LE(2 * short_run.admm_iterations, long_run.admm_iterations);
  EXPECT_LE(short_run.residual, 2 * long_run.residual);
  impatient.patience = 30;
  for (Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    EXPECT_EQ(cascade.solve(scene.problem, impatient).status, ContactStatus::Converged);
  }
}

// Every solver of the cascade solves what the previous ones could not.
TEST(ContactCascade, FallsBackFromOneSolverToTheNext) {
  ContactSolverOptions options;
  options.tolerance = 1e-8;
  ContactProblem problem = arch_scene(51);
  ContactCascade cascade;
  EXPECT_EQ(cascade.solve(problem, options).solver, "interior points");
  problem = arch_scene(15);
  for (ContactBody& body : problem.bodies) {  // slides along the floor, as a whole
    if (!body.inverse_mass_W.isZero(0)) body.free_v_W += Vector3(0, 1, 0);
  }
  EXPECT_EQ(cascade.solve(problem, options).solver, "interior points");
  EXPECT_EQ(cascade.solve(problem, {.tolerance = 1e-10}).solver, "newton");  // from that start
  problem = arch_scene(25);
  options.newton_limit = 0;
  options.admm_limit = 1000;
  const ContactReport report = cascade.solve(problem, options);
  EXPECT_EQ(report.solver, "admm");
  EXPECT_EQ(report.status, ContactStatus::Converged);
}

// Friction up to 5 with duplicate contacts and locked axes, where a solution need not exist.
// Recorded, of 200: 168 after a round, 191 after two, 199 with other starts.
TEST(ContactCascade, GoesRoundAgainAndThenBeginsAgain) {
  std::mt19937_64 random(51);
  constexpr int kProblems = 200;
  int first_round = 0;
  int both_rounds = 0;
  int all_starts = 0;
  ContactCascade cascade;
  for (int i = 0; i < kProblems; ++i) {
    RandomContacts wanted;
    wanted.bodies = 4;
    wanted.contacts = 14;
    wanted.friction = 5;
    wanted.has_degenerates = true;
    const ContactProblem begin = random_contact_problem(wanted, random);
    ContactSolverOptions options;
    options.tolerance = 1e-8;
    const auto is_solved = [&] {
      ContactProblem problem = begin;
      const ContactReport report = cascade.solve(problem, options);
      EXPECT_EQ(broken_contact_law(problem, report.residual * 1.001 + 1e-13), "");
      return report.status == ContactStatus::Converged;
    };
    all_starts += is_solved();
    options.restart_contacts = 0;
    both_rounds += is_solved();
    options.cascade_rounds = 1;
    first_round += is_solved();
  }
  std::printf("solved %d of %d in one round, %d in two, %d with other starts\n", first_round,
              kProblems, both_rounds, all_starts);
  EXPECT_GT(both_rounds, first_round);
  EXPECT_GT(all_starts, both_rounds);
  EXPECT_GE(all_starts, kProblems * 19 / 20);
}

TEST(ContactTolerance, FollowsTheSpeedWithinItsBounds) {
  EXPECT_DOUBLE_EQ(contact_tolerance(0, 1e-4, 0.01), 1e-9);
  EXPECT_DOUBLE_EQ(contact_tolerance(5e-3, 1e-4, 0.01), 5e-9);
  EXPECT_DOUBLE_EQ(contact_tolerance(0.5, 1e-4, 0.01), 2.5e-5);
  EXPECT_DOUBLE_EQ(contact_tolerance(100, 1e-4, 0.01), 1e-3);
  EXPECT_THROW(contact_tolerance(-1, 1e-4, 0.01), InvalidArgument);
  EXPECT_THROW(contact_tolerance(1, 0, 0.01), InvalidArgument);
}

}  // namespace
}  // namespace dyop::testing
