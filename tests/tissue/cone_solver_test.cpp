// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cone_solver.h"

#include <gtest/gtest.h>

#include <random>

#include "support/inputs/random_inputs.h"

namespace dyop::tissue_internal {
namespace {

struct ConeProblem {
  Eigen::MatrixXd compliance;
  Eigen::VectorXd free;
  Scalar friction = 0;
};

ConeAnswer solve_cones(const ConeProblem& problem) {
  return ConeSolver(problem.compliance, problem.friction).solve(problem.free);
}

// Contacts of a tool on springs with tissue: a part of low rank, and one for each alone.
ConeProblem random_problem(int contacts, Scalar friction, Scalar size, std::mt19937_64& random) {
  const Eigen::Index rows = 3 * contacts;
  const auto uniform = [&] { return testing::random_number(-1, 1, random); };
  const Eigen::MatrixXd springs = Eigen::MatrixXd::NullaryExpr(rows, 6, uniform);
  const Eigen::MatrixXd tissue = Eigen::MatrixXd::NullaryExpr(rows, rows, uniform);
  ConeProblem problem;
  problem.compliance =
      size * (springs * springs.transpose() + tissue * tissue.transpose() / Scalar(rows) +
              0.05 * Eigen::MatrixXd::Identity(rows, rows));
  problem.free = Eigen::VectorXd::NullaryExpr(rows, [&] { return uniform() - 0.3; });
  problem.friction = friction;
  return problem;
}

// The laws, each by itself.
void expect_lawful(const ConeProblem& problem, const ConeAnswer& answer) {
  const Eigen::VectorXd apart = problem.free + problem.compliance * answer.forces;
  const Scalar near = 1e-6 * problem.free.cwiseAbs().maxCoeff();
  const Scalar weak = near / problem.compliance.diagonal().minCoeff();
  for (Eigen::Index c = 0; c < problem.free.size() / 3; ++c) {
    const Vector3 force = answer.forces.segment<3>(3 * c), r = apart.segment<3>(3 * c);
    const Scalar tangential = force.tail<2>().norm(), sliding = r.tail<2>().norm();
    EXPECT_GE(force[0], 0);
    EXPECT_GE(r[0], -near);
    EXPECT_LE(tangential, problem.friction * force[0] + weak);
    switch (answer.states[std::size_t(c)]) {
      case ConeState::Open:
        EXPECT_LE(force.norm(), weak);
        break;
      case ConeState::Stick:
        EXPECT_LE(std::abs(r[0]), near);
        EXPECT_LE(sliding, near);
        break;
      case ConeState::Slip:
        EXPECT_LE(std::abs(r[0]), near);
        EXPECT_GE(tangential, problem.friction * force[0] - 10 * weak);
        EXPECT_NEAR(force.tail<2>().dot(r.tail<2>()), -tangential * sliding,
                    100 * near * (tangential + weak));
        break;
    }
  }
}

TEST(ConeSolver, ObeysTheLaws) {
  std::mt19937_64 random(1);
  int exact = 0, all = 0;
  std::array<int, 3> seen{};
  for (const int contacts : {1, 2, 3, 6, 15, 40}) {
    for (const Scalar friction : {0.0, 0.2, 0.6, 1.5}) {
      for (const Scalar size : {1e-4, 1.0, 1e4}) {
        for (int k = 0; k < 4; ++k) {
          const ConeProblem problem = random_problem(contacts, friction, size, random);
          const ConeAnswer answer = solve_cones(problem);
          ++all;
          exact += answer.is_exact;
          for (const ConeState state : answer.states) ++seen[std::size_t(state)];
          if (answer.is_exact) expect_lawful(problem, answer);
        }
      }
    }
  }
  EXPECT_GE(exact, 0.95 * all);
  for (const int count : seen) EXPECT_GT(count, 100);
}

// A solver that keeps its factor for the next of many problems, near to or far from the last one.
TEST(ConeSolver, ObeysTheLawsFromSolveToSolve) {
  std::mt19937_64 random(3);
  int exact = 0, all = 0;
  for (const Scalar friction : {0.0, 0.2, 0.6}) {
    for (const Scalar change : {0.001, 0.1, 2.0}) {
      ConeProblem problem = random_problem(20, friction, 1, random);
      ConeSolver solver(problem.compliance, friction);
      Eigen::VectorXd guess;
      for (int k = 0; k < 20; ++k) {
        const ConeAnswer answer = solver.solve(problem.free, guess);
        if (answer.is_exact) expect_lawful(problem, answer);
        exact += answer.is_exact;
        ++all;
        guess = answer.forces;
        problem.free += change * Eigen::VectorXd::NullaryExpr(problem.free.size(), [&] {
                          return testing::random_number(-1, 1, random);
                        });
      }
    }
  }
  EXPECT_GE(exact, 0.95 * all);
}

TEST(ConeSolver, StaysInTheConesWhereItIsNotExact) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 100; ++k) {
    ConeProblem problem = random_problem(8, 3.0, 1, random);  // may have no solution
    const ConeAnswer answer = solve_cones(problem);
    for (Eigen::Index c = 0; c < 8; ++c) {
      EXPECT_GE(answer.forces[3 * c], 0);
      EXPECT_LE(answer.forces.segment<2>(3 * c + 1).norm(), 3 * answer.forces[3 * c] * (1 + 1e-12));
    }
  }
}

// A block of weight pulled aside on a spring: sticks up to the cone, then slips.
TEST(ConeSolver, AgreesWithOneBlockOnASpring) {
  ConeProblem problem;
  problem.compliance = 0.5 * Eigen::MatrixXd::Identity(3, 3);
  problem.friction = 0.4;
  problem.free = Vector3(-1, 0.3, 0);  // normal force 2: at most 0.8 aside, which springs 0.4
  ConeAnswer answer = solve_cones(problem);
  EXPECT_TRUE(answer.is_exact);
  EXPECT_EQ(answer.states[0], ConeState::Stick);
  EXPECT_LE((answer.forces - Vector3(2, -0.6, 0)).norm(), 1e-7);
  problem.free = Vector3(-1, 0.3, 0.4);
  answer = solve_cones(problem);
  EXPECT_EQ(answer.states[0], ConeState::Slip);
  EXPECT_LE((answer.forces - Vector3(2, -0.8 * 0.6, -0.8 * 0.8)).norm(), 1e-7);
  problem.free = Vector3(0.1, 0.3, 0.4);
  answer = solve_cones(problem);
  EXPECT_EQ(answer.states[0], ConeState::Open);
  EXPECT_TRUE(answer.forces.isZero(0));
  EXPECT_TRUE(solve_cones({}).is_exact);
}

}  // namespace
}  // namespace dyop::tissue_internal
