// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/body_matrix.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::random_index;
using dyop::testing::random_number;
using dyop::testing::random_vector;

// The same matrix as a dense one.
Eigen::MatrixXd dense_matrix(const ContactSystem& system, const std::vector<Matrix3>& D) {
  const Eigen::Index size = 6 * Eigen::Index(system.velocities().size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Identity(size, size);
  for (std::size_t i = 0; i < D.size(); ++i) {
    const Block& block = system.blocks()[i];
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(3, size);
    if (block.slot_a >= 0) G.middleCols<6>(6 * block.slot_a) += block.G_a;
    if (block.slot_b >= 0) G.middleCols<6>(6 * block.slot_b) += block.G_b;
    for (const Carried& more : carried_by(block)) G.middleCols<6>(6 * more.slot) += more.G;
    H += G.transpose() * D[i] * G;
  }
  return H;
}

Matrix3 random_matrix(bool is_symmetric, std::mt19937_64& random) {
  Matrix3 A;
  for (Scalar& a : A.reshaped()) a = random_number(-1, 1, random);
  const Matrix3 square = A * A.transpose();
  return is_symmetric ? square : Matrix3(square + 0.3 * A);
}

// The same with what one block's normal impulse does to another: add_between().
void add_random_links(const ContactSystem& system, std::mt19937_64& random, BodyMatrix& matrix,
                      Eigen::MatrixXd& H) {
  const auto rows_of = [&](const Block& block) {
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(3, H.cols());
    if (block.slot_a >= 0) G.middleCols<6>(6 * block.slot_a) += block.G_a;
    if (block.slot_b >= 0) G.middleCols<6>(6 * block.slot_b) += block.G_b;
    return G;
  };
  for (std::size_t i = 0; i < system.blocks().size(); ++i) {
    const Block& block = system.blocks()[i];
    if (block.owner < 0) continue;
    const Vector3 left = random_vector(1, random), right = random_vector(1, random);
    matrix.add_between(system, i, left, std::size_t(block.owner), right);
    H += rows_of(block).transpose() * left * right.transpose() *
         rows_of(system.blocks()[std::size_t(block.owner)]);
  }
}

// x solves the dense system, for every pattern of bodies and both kinds of matrices.
TEST(BodyMatrix, SolvesAsTheDenseMatrixDoes) {
  std::mt19937_64 random(31);
  BodyMatrix matrix;  // one for all, so that patterns are replaced
  for (int i = 0; i < 200; ++i) {
    testing::RandomContacts wanted;
    // Every twentieth large enough for branches of the elimination tree.
    wanted.bodies = (i % 20 == 19 ? 100 : 1) + random_index(20, random);
    wanted.contacts = random_index(3 * wanted.bodies, random);
    ContactSystem system;
    ContactProblem problem = testing::random_contact_problem(wanted, random);
    if (i % 3 == 1) {
      for (PointContact& contact : problem.contacts) contact.torsional_friction = 0.1;
    }
    system.build(i % 3 == 0 ? testing::with_divided_bodies(problem, random) : problem);
    const bool is_symmetric = i % 2 == 0;
    std::vector<Matrix3> D;
    for (std::size_t k = 0; k < system.blocks().size(); ++k) {
      D.push_back(random_matrix(is_symmetric, random));
      if (system.blocks()[k].kind == BlockKind::Torsion) D.back().bottomRows<2>().setZero();
      if (system.blocks()[k].kind == BlockKind::Torsion) D.back().rightCols<2>().setZero();
    }
    matrix.analyse(system);
    matrix.reset(is_symmetric);
    for (std::size_t k = 0; k < D.size(); ++k) matrix.add(system, k, D[k]);
    Eigen::MatrixXd H = dense_matrix(system, D);
    if (!is_symmetric) add_random_links(system, random, matrix, H);
    ASSERT_TRUE(matrix.factorise({})) << "problem " << i;
    std::vector<Vector6> x(system.velocities().size());
    Eigen::VectorXd b(6 * Eigen::Index(x.size()));
    for (Scalar& value : b) value = random_number(-1, 1, random);
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = b.segment<6>(6 * Eigen::Index(k));
    matrix.solve(x, {});
    Eigen::VectorXd answer(b.size());
    for (std::size_t k = 0; k < x.size(); ++k) answer.segment<6>(6 * Eigen::Index(k)) = x[k];
    EXPECT_LE((H * answer - b).norm(), 1e-10 * H.norm() * answer.norm()) << "problem " << i;
  }
}

// Few rows, ten orders of magnitude stiffer than the bodies: what is soft keeps its digits. Products
// with the inverse of a diagonal block would leave some 1e-10 of the matrix.
TEST(BodyMatrix, KeepsSoftDirectionsBesideStiffOnes) {
  std::mt19937_64 random(32);
  for (int i = 0; i < 200; ++i) {
    testing::RandomContacts wanted;
    wanted.bodies = 2 + random_index(10, random);
    wanted.contacts = wanted.bodies;
    ContactSystem system;
    system.build(testing::random_contact_problem(wanted, random));
    const bool is_symmetric = i % 2 == 0;
    BodyMatrix matrix;
    matrix.analyse(system);
    matrix.reset(is_symmetric);
    std::vector<Matrix3> D;
    for (const Block& block : system.blocks()) {
      D.push_back(1e10 / block.weight * random_matrix(is_symmetric, random));
    }
    for (std::size_t k = 0; k < D.size(); ++k) matrix.add(system, k, D[k]);
    const Eigen::MatrixXd H = dense_matrix(system, D);
    ASSERT_TRUE(matrix.factorise({})) << "problem " << i;
    std::vector<Vector6> x(system.velocities().size());
    Eigen::VectorXd b(H.cols()), answer(H.cols());
    for (Scalar& value : b) value = random_number(-1, 1, random);
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = b.segment<6>(6 * Eigen::Index(k));
    matrix.solve(x, {});
    for (std::size_t k = 0; k < x.size(); ++k) answer.segment<6>(6 * Eigen::Index(k)) = x[k];
    EXPECT_LE((H * answer - b).norm(), 1e-13 * H.norm() * answer.norm()) << "problem " << i;
  }
}

TEST(BodyMatrix, RefusesWhatIsNotPositiveDefinite) {
  ContactSystem system;
  system.build(testing::stack_scene(3));
  BodyMatrix matrix;
  matrix.analyse(system);
  matrix.reset();
  matrix.add(system, 0, -100 * Matrix3::Identity());
  EXPECT_FALSE(matrix.factorise({}));
}

}  // namespace
}  // namespace dyop::contact_internal
