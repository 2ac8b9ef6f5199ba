// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>

#include "contact/all_contact_solvers.h"
#include "dyop/core/error.h"
#include "support/allocation_count.h"
#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_oracle.h"

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

struct Answer {
  ContactProblem problem;
  ContactReport report = {};
};

template <typename Solver>
class ContactSolverContract : public ::testing::Test {
 protected:
  static constexpr Scalar kTolerance = 1e-8;

  Answer solved(ContactProblem problem) {
    Answer answer{std::move(problem)};
    answer.report = solver_.solve(answer.problem, generous_options(kTolerance));
    return answer;
  }

  // Expects answer(0), answer(1), ... to be sound, and at least `percent` % of them converged.
  void expect_answers(int count, int percent, const std::function<Answer(int)>& answer) {
    int converged = 0;
    for (int i = 0; i < count; ++i) {
      const auto [problem, report] = answer(i);
      SCOPED_TRACE(::testing::Message() << "problem " << i);
      expect_sound(problem, report, kTolerance);
      converged += report.status == ContactStatus::Converged;
    }
    std::printf("%s: solved %d of %d\n", std::string(solver_.name()).c_str(), converged, count);
    EXPECT_GE(converged, count * percent / 100);
  }

  Solver solver_;
};
TYPED_TEST_SUITE(ContactSolverContract, AllContactSolvers);

TYPED_TEST(ContactSolverContract, AnswersObeyTheLaws) {
  std::mt19937_64 random(11);
  this->expect_answers(400, 97, [&](int i) {
    RandomContacts wanted;
    wanted.bodies = 1 + random_index(8, random);
    wanted.contacts = random_index(4 * wanted.bodies + 1, random);
    wanted.friction = i % 8 == 0 ? 3 : 0.7;
    wanted.largest_ratio = i % 5 == 0 ? 1e6 : 10;
    wanted.has_degenerates = i % 2 == 0;
    return this->solved(random_contact_problem(wanted, random));
  });
}

// A body that is divided in two, both of which carry its contacts, moves as it does whole.
TYPED_TEST(ContactSolverContract, CarriersOfAContactActAsOneBody) {
  std::mt19937_64 random(19);
  this->expect_answers(200, 97, [&](int) {
    RandomContacts wanted;
    wanted.bodies = 1 + random_index(6, random);
    wanted.contacts = random_index(3 * wanted.bodies + 1, random);
    Answer whole{random_contact_problem(wanted, random)};
    const Answer divided = this->solved(with_divided_bodies(whole.problem, random));
    join_bodies(divided.problem, whole.problem);
    whole.report = divided.report;
    return whole;
  });
}

TYPED_TEST(ContactSolverContract, RefusesCarriersThatCannotBe) {
  const ContactProblem whole = stack_scene(2);
  std::mt19937_64 random(20);
  const auto refuses = [&](const auto& change) {
    ContactProblem problem = with_divided_bodies(whole, random);
    change(problem);
    EXPECT_THROW(this->solver_.solve(problem), InvalidArgument);
  };
  refuses([](ContactProblem& p) { p.carriers[0].contact = p.contacts.size(); });
  refuses([](ContactProblem& p) { p.carriers[0].body = p.bodies.size(); });
  refuses([](ContactProblem& p) { p.carriers[0].body = p.contacts[0].body_a; });
  refuses([](ContactProblem& p) { p.carriers[0].body = p.carriers[1].body; });
  refuses([](ContactProblem& p) { p.carriers[0].r_W.setConstant(std::nan("")); });
  refuses([](ContactProblem& p) { std::swap(p.carriers.front(), p.carriers.back()); });
  refuses([](ContactProblem& p) { p.contacts[0].torsional_friction = 0.1; });
  refuses(
      [](ContactProblem& p) { p.friction_law = [](std::size_t, const Vector3&) { return 0.5; }; });
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
  EXPECT_EQ(converged, count);
}

bool has_same_bits(const ContactProblem& a, const ContactProblem& b) {
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    if (a.bodies[i].v_W != b.bodies[i].v_W || a.bodies[i].w_W != b.bodies[i].w_W) return false;
  }
  for (std::size_t i = 0; i < a.contacts.size(); ++i) {
    if (a.contacts[i].impulse_W != b.contacts[i].impulse_W) return false;
  }
  return true;
}

TYPED_TEST(ContactSolverContract, EarlierProblemsChangeNoBit) {
  std::mt19937_64 random(13);
  for (int i = 0; i < 50; ++i) {
    RandomContacts wanted;
    wanted.bodies = 1 + random_index(5, random);
    wanted.contacts = random_index(12, random);
    ContactProblem used = random_contact_problem(wanted, random);
    ContactProblem fresh = used;
    this->solver_.solve(used, generous_options(1e-8));
    TypeParam other;
    other.solve(fresh, generous_options(1e-8));
    EXPECT_TRUE(has_same_bits(used, fresh)) << "problem " << i;
  }
}

// Two different solvers find the same velocities where these are unique: without friction they are.
TYPED_TEST(ContactSolverContract, AgreesWithGaussSeidelWithoutFriction) {
  std::mt19937_64 random(14);
  for (int i = 0; i < 100; ++i) {
    RandomContacts wanted;
    wanted.friction = 0;
    wanted.has_degenerates = i % 2 == 0;
    ContactProblem problem = random_contact_problem(wanted, random);
    ContactProblem judge = problem;
    const ContactReport report = this->solver_.solve(problem, generous_options(1e-10));
    GaussSeidelSolver gauss_seidel;
    const ContactReport judged = gauss_seidel.solve(judge, generous_options(1e-10));
    if (report.status != ContactStatus::Converged) continue;
    if (judged.status != ContactStatus::Converged) continue;
    for (std::size_t k = 0; k < problem.bodies.size(); ++k) {
      EXPECT_LE((problem.bodies[k].v_W - judge.bodies[k].v_W).norm(), 1e-6) << "problem " << i;
    }
  }
}

TYPED_TEST(ContactSolverContract, AllocatesNothingOnceWarm) {
  for (const ContactProblem& scene :
       {haptic_scene(4), haptic_scene(12), stack_scene(10), arch_scene(25)}) {
    ContactProblem problem = scene;
    this->solver_.solve(problem);
    for (PointContact& contact : problem.contacts) contact.impulse_W.setZero();
    const std::int64_t before = allocation_count();
    const ContactReport report = this->solver_.solve(problem);
    EXPECT_EQ(allocation_count(), before);
    EXPECT_GT(report.sweeps + report.newton_iterations + report.admm_iterations, 0);
  }
}

TYPED_TEST(ContactSolverContract, NothingToDoIsSolved) {
  ContactProblem problem;
  EXPECT_EQ(this->solver_.solve(problem).status, ContactStatus::Converged);
  problem.bodies.push_back(box_body(Vector3::Ones(), 1, Matrix3::Identity(), Vector3(1, 2, 3)));
  const ContactReport report = this->solver_.solve(problem);
  EXPECT_EQ(report.status, ContactStatus::Converged);
  EXPECT_EQ(problem.bodies[0].v_W, Vector3(1, 2, 3));
}

// A solution handed in as the warm start is recognised at once.
TYPED_TEST(ContactSolverContract, ASolutionStaysAsItIs) {
  std::mt19937_64 random(15);
  for (int i = 0; i < 30; ++i) {
    ContactProblem problem = random_contact_problem({}, random);
    if (this->solver_.solve(problem, generous_options(1e-10)).status != ContactStatus::Converged) {
      continue;
    }
    const Vector3 v_W = problem.bodies[1].v_W;
    const ContactReport report = this->solver_.solve(problem, generous_options(1e-8));
    EXPECT_EQ(report.status, ContactStatus::Converged);
    EXPECT_LE(report.sweeps + report.newton_iterations + report.admm_iterations, 20);
    EXPECT_LE((problem.bodies[1].v_W - v_W).norm(), 1e-7);
  }
}

TYPED_TEST(ContactSolverContract, ImmovableBodiesAreReportedNotSolved) {
  ContactProblem problem = box_on_plane(Vector3::Ones(), 1, 0, 0.5, Vector3::Zero());
  problem.bodies[1].inverse_mass_W.setZero();
  problem.bodies[1].inverse_inertia_W.setZero();
  problem.bodies[1].free_v_W = Vector3(0, 0, -1);
  const ContactReport report = this->solver_.solve(problem);
  EXPECT_EQ(report.immovable_violations, 4);
  EXPECT_EQ(problem.bodies[1].v_W, Vector3(0, 0, -1));
  problem.bodies[1].free_v_W = Vector3(0, 0, 1);
  EXPECT_EQ(this->solver_.solve(problem).immovable_violations, 0);
}

TYPED_TEST(ContactSolverContract, BadInputIsNamed) {
  const ContactProblem good = box_on_plane(Vector3::Ones(), 1, 0, 0.5, Vector3::Zero());
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const auto expect_refused = [&](const auto& spoil) {
    ContactProblem bad = good;
    spoil(bad);
    EXPECT_THROW(this->solver_.solve(bad), InvalidArgument);
  };
  expect_refused([&](ContactProblem& p) { p.contacts[1].friction = -1; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].friction = nan; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].target = nan; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].sticking_velocity_W.y() = nan; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].r_b_W[2] = nan; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].nhat_AB_W *= 2; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].body_a = 1; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].body_a = 7; });
  expect_refused([&](ContactProblem& p) { p.contacts[1].rolling_friction = -1; });
  expect_refused([&](ContactProblem& p) { p.bodies[1].free_w_W[0] = nan; });
  expect_refused([&](ContactProblem& p) { p.bodies[1].inverse_mass_W(1, 1) = -1; });
  expect_refused([&](ContactProblem& p) {
    p.rows.emplace_back().body_b = 1;
    p.rows[0].lower = 1;
    p.rows[0].upper = -1;
  });
  expect_refused([&](ContactProblem& p) {
    p.friction_law = [](std::size_t, const Vector3&) { return -0.5; };
  });
  ContactProblem problem = good;
  ContactSolverOptions options;
  options.tolerance = 0;
  EXPECT_THROW(this->solver_.solve(problem, options), InvalidArgument);
}

// Random chains of joints of all kinds among contacts.
TYPED_TEST(ContactSolverContract, RowsAndContactsTogetherObeyTheirLaws) {
  std::mt19937_64 random(16);
  this->expect_answers(100, 95, [&](int) {
    RandomContacts wanted;
    wanted.friction = 0.4;
    wanted.contacts = 6;
    ContactProblem problem = random_contact_problem(wanted, random);
    for (std::size_t k = 1; k < problem.bodies.size(); ++k) {
      JointRow row;
      row.body_a = k - 1;
      row.body_b = k;
      row.j_av_W = random_vector(1, random);
      row.j_bv_W = -row.j_av_W;
      row.j_aw_W = random_vector(1, random);
      row.j_bw_W = random_vector(1, random);
      const int kind = random_index(4, random);
      if (kind == 1) row.lower = 0;
      if (kind == 2) std::tie(row.lower, row.upper) = std::pair(-0.3, 0.2);
      if (kind == 3) row.compliance = 0.5;
      row.target = kind == 2 ? random_number(-1, 1, random) : 0;
      problem.rows.push_back(row);
    }
    for (PointContact& contact : problem.contacts) {
      if (random_index(2, random) == 0) contact.rolling_friction = 0.1;
      if (random_index(2, random) == 0) contact.torsional_friction = 0.05;
    }
    return this->solved(std::move(problem));
  });
}

}  // namespace
}  // namespace dyop::testing
