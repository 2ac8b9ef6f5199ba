// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "all_contact_solvers.h"
#include "contact/solver/shared_loops.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/error.h"
#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using contact_internal::SharedLoops;
using testing::random_index;

// The machine may have fewer threads than a test asks for.
template <typename Work>
void with_eight_threads(const Work& work) {
  const tbb::global_control threads{tbb::global_control::max_allowed_parallelism, 8};
  tbb::task_arena arena{8};
  arena.execute(work);
}

// Large enough to be shared: of contacts alone, with turning, with joints.
std::vector<ContactProblem> large_problems() {
  std::vector<ContactProblem> problems{testing::pile_scene(8, 8), testing::wall_scene(16, 10)};
  std::mt19937_64 random(92);
  for (int i = 0; i < 6; ++i) {
    testing::RandomContacts wanted;
    wanted.bodies = 150 + random_index(400, random);
    wanted.contacts = 600 + random_index(1500, random);
    wanted.has_degenerates = i % 2 == 0;
    problems.push_back(testing::random_contact_problem(wanted, random));
  }
  for (std::size_t i = 0; i < problems.back().contacts.size(); i += 3) {
    problems.back().contacts[i].rolling_friction = 0.05;
    problems.back().contacts[i].torsional_friction = 0.02;
  }
  return problems;
}

void expect_same_bits(const ContactProblem& x, const ContactProblem& y) {
  for (std::size_t i = 0; i < x.contacts.size(); ++i) {
    ASSERT_EQ(x.contacts[i].impulse_W, y.contacts[i].impulse_W) << "contact " << i;
    ASSERT_EQ(x.contacts[i].angular_impulse_W, y.contacts[i].angular_impulse_W) << "contact " << i;
  }
  for (std::size_t i = 0; i < x.rows.size(); ++i) ASSERT_EQ(x.rows[i].impulse, y.rows[i].impulse);
  for (std::size_t i = 0; i < x.bodies.size(); ++i) {
    ASSERT_EQ(x.bodies[i].v_W, y.bodies[i].v_W) << "body " << i;
    ASSERT_EQ(x.bodies[i].w_W, y.bodies[i].w_W) << "body " << i;
  }
}

template <typename Solver>
class SharedProblemOf : public ::testing::Test {};
TYPED_TEST_SUITE(SharedProblemOf, testing::AllContactSolvers);

TYPED_TEST(SharedProblemOf, HasTheSameBitsForAnyNumberOfThreads) {
  with_eight_threads([] {
    TypeParam solver;
    ContactSolverOptions options;
    options.newton_limit = 20;
    options.admm_limit = 20;
    for (const ContactProblem& problem : large_problems()) {
      ContactProblem alone = problem;
      options.thread_count = 1;
      const ContactReport wanted = solver.solve(alone, options);
      for (const int threads : {2, 3, 8}) {
        ContactProblem shared = problem;
        options.thread_count = threads;
        const ContactReport report = solver.solve(shared, options);
        EXPECT_EQ(report.residual, wanted.residual) << threads << " threads";
        EXPECT_EQ(report.newton_iterations, wanted.newton_iterations);
        EXPECT_EQ(report.sweeps, wanted.sweeps);
        expect_same_bits(alone, shared);
      }
    }
  });
}

TEST(SharedProblem, NamesTheFirstContactThatIsInvalid) {
  with_eight_threads([] {
    ContactSolverOptions options;
    options.thread_count = 8;
    ContactProblem problem = testing::pile_scene(8, 8);
    ASSERT_GT(problem.contacts.size(), 500u);
    problem.contacts[451].friction = -2;
    problem.contacts[450].friction = -1;
    ContactCascade solver;
    const std::string message = testing::message_of([&] { solver.solve(problem, options); });
    EXPECT_NE(message.find("contact 450: friction must be finite and >= 0, not -1"),
              std::string::npos)
        << message;
    options.thread_count = -3;
    EXPECT_THROW(solver.solve(problem, options), InvalidArgument);
  });
}

TEST(SharedLoops, KeepANumberThatIsNone) {
  constexpr Scalar kNan = std::numeric_limits<Scalar>::quiet_NaN();
  with_eight_threads([&] {
    core_internal::with_team(8, [&](core_internal::Team& team) {
      for (core_internal::Team* shared : {static_cast<core_internal::Team*>(nullptr), &team}) {
        SharedLoops loops;
        loops.set_team(shared);
        for (std::size_t bad = 0; bad < 300; bad += 23) {
          const auto value = [&](std::size_t i) { return i == bad ? kNan : Scalar(i); };
          EXPECT_TRUE(std::isnan(loops.largest(300, value))) << bad;
        }
        EXPECT_EQ(loops.largest(300, [](std::size_t i) { return Scalar(i * 7 % 300); }), 299);
        EXPECT_EQ(loops.largest(0, [](std::size_t) { return 1; }), 0);
        EXPECT_EQ(loops.sum(1, 300, [](std::size_t i) { return Scalar(i); }), 1 + 299 * 150);
      }
    });
  });
}

}  // namespace
}  // namespace dyop
