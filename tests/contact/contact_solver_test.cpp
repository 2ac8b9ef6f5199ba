#include "dyop/contact/contact_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "contact/all_contact_solvers.h"
#include "dyop/core/error.h"
#include "support/contact_oracle.h"
#include "support/contact_scenes.h"
#include "support/random_inputs.h"

namespace dyop::testing {
namespace {

ContactSolverOptions generous_options(Scalar tolerance) {
  ContactSolverOptions options;
  options.tolerance = tolerance;
  options.sweep_limit = options.few_sweep_limit = 2000;
  options.newton_limit = 300;
  options.admm_limit = 2000;
  return options;
}

// What holds for every answer, converged or not.
void expect_sound(const ContactProblem& problem, const ContactReport& report, Scalar tolerance) {
  EXPECT_LE(momentum_error(problem), 1e-12);
  // Computed in other axes and another order: equal up to rounding of the speeds involved.
  Scalar speed = 0;
  for (const ContactBody& body : problem.bodies) {
    for (const PointContact& contact : problem.contacts) {
      speed = std::max(speed, body.free_v_W.norm() + body.free_w_W.norm() * contact.r_b_W.norm());
    }
  }
  EXPECT_NEAR(contact_residual(problem), report.residual, 1e-9 * report.residual + 1e-9 * speed);
  EXPECT_EQ(report.status == ContactStatus::Converged, report.residual <= tolerance);
  EXPECT_EQ(broken_contact_law(problem, report.residual * 1.001 + 1e-11 * speed), "");
}

template <typename Solver>
class ContactSolverContract : public ::testing::Test {
 protected:
  Solver solver_;
};
TYPED_TEST_SUITE(ContactSolverContract, AllContactSolvers);

TYPED_TEST(ContactSolverContract, AnswersObeyTheLaws) {
  std::mt19937_64 random(11);
  int converged = 0;
  constexpr int kProblems = 400;
  for (int i = 0; i < kProblems; ++i) {
    RandomContacts wanted;
    wanted.bodies = 1 + random_index(8, random);
    wanted.contacts = random_index(4 * wanted.bodies + 1, random);
    wanted.friction = i % 8 == 0 ? 3 : 0.7;
    wanted.largest_ratio = i % 5 == 0 ? 1e6 : 10;
    wanted.has_degenerates = i % 2 == 0;
    ContactProblem problem = random_contact_problem(wanted, random);
    const ContactReport report = this->solver_.solve(problem, generous_options(1e-8));
    SCOPED_TRACE(::testing::Message() << "problem " << i);
    expect_sound(problem, report, 1e-8);
    converged += report.status == ContactStatus::Converged;
  }
  std::printf("converged %d of %d\n", converged, kProblems);
}

TYPED_TEST(ContactSolverContract, AnswersDoNotDependOnUnits) {
  std::mt19937_64 random(12);
  int converged = 0;
  int count = 0;
  for (const Scalar length : {1e-4, 1.0, 1e4}) {
    for (const Scalar mass : {1e-4, 1.0, 1e4}) {
      for (const Scalar speed : {1e-4, 1.0, 1e4}) {
        for (int i = 0; i < 5; ++i) {
          RandomContacts wanted;
          wanted.length = length;
          wanted.mass = mass;
          wanted.speed = speed;
          wanted.friction = 0.4;
          ContactProblem problem = random_contact_problem(wanted, random);
          const ContactReport report = this->solver_.solve(problem, generous_options(1e-8 * speed));
          expect_sound(problem, report, 1e-8 * speed);
          converged += report.status == ContactStatus::Converged;
          ++count;
        }
      }
    }
  }
  std::printf("converged %d of %d\n", converged, count);
}

}  // namespace
}  // namespace dyop::testing
