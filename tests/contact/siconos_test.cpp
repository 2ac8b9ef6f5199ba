// SPDX-License-Identifier: BSD-3-Clause

// Siconos as the judge: its solvers get the same contact problems, as matrices, and must find the
// same velocities. Impulses of single contacts are not unique and are not compared.

#include <gtest/gtest.h>

#ifdef DYOP_HAS_SICONOS

#include <siconos/numerics/FrictionContactProblem.h>
#include <siconos/numerics/Friction_cst.h>
#include <siconos/numerics/NonSmoothDrivers.h>
#include <siconos/numerics/NumericsMatrix.h>
#include <siconos/numerics/SolverOptions.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "contact/all_contact_solvers.h"
#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/contact_oracle.h"

namespace dyop::testing {
namespace {

// Relative velocities of all contacts, normal first, as rows of H times all body velocities.
struct Matrices {
  Eigen::MatrixXd H;         // 3 contacts x 6 bodies
  Eigen::MatrixXd mobility;  // 6 bodies, block diagonal
  Eigen::VectorXd free;      // velocities of the bodies
  Eigen::VectorXd target;    // of the contacts
  std::vector<double> friction;
};

Matrices matrices_of(const ContactProblem& problem) {
  const Eigen::Index rows = 3 * Eigen::Index(problem.contacts.size());
  const Eigen::Index columns = 6 * Eigen::Index(problem.bodies.size());
  Matrices m;
  m.H = Eigen::MatrixXd::Zero(rows, columns);
  m.mobility = Eigen::MatrixXd::Zero(columns, columns);
  m.free = Eigen::VectorXd::Zero(columns);
  m.target = Eigen::VectorXd::Zero(rows);
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
    const Eigen::Index at = 6 * Eigen::Index(i);
    m.mobility.block<3, 3>(at, at) = problem.bodies[i].inverse_mass_W;
    m.mobility.block<3, 3>(at + 3, at + 3) = problem.bodies[i].inverse_inertia_W;
    m.free.segment<3>(at) = problem.bodies[i].free_v_W;
    m.free.segment<3>(at + 3) = problem.bodies[i].free_w_W;
  }
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const PointContact& contact = problem.contacts[i];
    const Vector3 n = contact.nhat_AB_W;
    const Vector3 t = n.unitOrthogonal();
    const Vector3 directions[3] = {n, t, n.cross(t)};
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Vector3 d = directions[k];
      auto row = m.H.row(3 * Eigen::Index(i) + k);
      row.segment<3>(6 * Eigen::Index(contact.body_b)) += d.transpose();
      row.segment<3>(6 * Eigen::Index(contact.body_b) + 3) += contact.r_b_W.cross(d).transpose();
      row.segment<3>(6 * Eigen::Index(contact.body_a)) -= d.transpose();
      row.segment<3>(6 * Eigen::Index(contact.body_a) + 3) -= contact.r_a_W.cross(d).transpose();
    }
    m.target.segment<3>(3 * Eigen::Index(i)) << contact.target, t.dot(contact.sticking_velocity_W),
        n.cross(t).dot(contact.sticking_velocity_W);
    m.friction.push_back(contact.friction);
  }
  return m;
}

double* c_array(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  double* array = static_cast<double*>(std::malloc(sizeof(double) * std::size_t(values.size())));
  Eigen::Map<Eigen::MatrixXd>(array, values.rows(), values.cols()) = values;
  return array;
}

// Velocities of the bodies by Siconos' Gauss-Seidel; `is_solved` if its own error is small enough.
Eigen::VectorXd siconos_velocities(const Matrices& m, double tolerance, bool& is_solved) {
  const int count = int(m.friction.size());
  const Eigen::MatrixXd W = m.H * m.mobility * m.H.transpose();
  const Eigen::VectorXd q = m.H * m.free - m.target;
  // Siconos frees what it is given.
  NumericsMatrix* matrix = NM_create_from_data(NM_DENSE, 3 * count, 3 * count, c_array(W));
  double* friction = c_array(Eigen::Map<const Eigen::VectorXd>(m.friction.data(), count));
  FrictionContactProblem* problem =
      frictionContactProblem_new_with_data(3, count, matrix, c_array(q), friction);
  SolverOptions* options = solver_options_create(SICONOS_FRICTION_3D_NSGS);
  options->dparam[SICONOS_DPARAM_TOL] = tolerance;
  options->iparam[SICONOS_IPARAM_MAX_ITER] = 100000;
  Eigen::VectorXd reaction = Eigen::VectorXd::Zero(3 * count);
  Eigen::VectorXd velocity = Eigen::VectorXd::Zero(3 * count);
  is_solved = fc3d_driver(problem, reaction.data(), velocity.data(), options) == 0;
  solver_options_delete(options);
  frictionContactProblem_free(problem);
  return m.free + m.mobility * m.H.transpose() * reaction;
}

Eigen::VectorXd velocities_of(const ContactProblem& problem) {
  Eigen::VectorXd v(6 * Eigen::Index(problem.bodies.size()));
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) {
    v.segment<3>(6 * Eigen::Index(i)) = problem.bodies[i].v_W;
    v.segment<3>(6 * Eigen::Index(i) + 3) = problem.bodies[i].w_W;
  }
  return v;
}

template <typename Solver>
class Siconos : public ::testing::Test {};
TYPED_TEST_SUITE(Siconos, AllContactSolvers);

TYPED_TEST(Siconos, FindsTheSameVelocities) {
  std::mt19937_64 random(21);
  TypeParam solver;
  ContactSolverOptions options;
  options.tolerance = 1e-11;
  options.sweep_limit = options.few_sweep_limit = 10000;
  options.newton_limit = 500;
  options.admm_limit = 10000;
  int compared = 0;
  constexpr int kProblems = 300;
  for (int i = 0; i < kProblems; ++i) {
    RandomContacts wanted;
    wanted.bodies = 1 + random_index(6, random);
    wanted.contacts = 1 + random_index(2 * wanted.bodies + 2, random);
    wanted.friction = 0.3;
    ContactProblem problem = random_contact_problem(wanted, random);
    const ContactReport report = solver.solve(problem, options);
    bool is_solved = false;
    const Eigen::VectorXd judged = siconos_velocities(matrices_of(problem), 1e-12, is_solved);
    if (!is_solved || report.status != ContactStatus::Converged) continue;
    ++compared;
    const Eigen::VectorXd v = velocities_of(problem);
    EXPECT_LE((v - judged).lpNorm<Eigen::Infinity>(), 1e-8) << "problem " << i;
  }
  std::printf("compared %d of %d\n", compared, kProblems);
  EXPECT_GE(compared, kProblems * 9 / 10);
}

}  // namespace
}  // namespace dyop::testing

#else

TEST(Siconos, FindsTheSameVelocities) {
  GTEST_SKIP() << "built without Siconos; on Debian: apt-get install libsiconos-numerics-dev";
}

#endif
