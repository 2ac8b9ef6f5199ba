// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/nested_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "dyop/core/error.h"
#include "support/inputs/random_inputs.h"

namespace dyop::tissue_internal {
namespace {

// A random part of a box of cells, with random blocks between neighbours, made definite.
struct LatticeMatrix {
  std::vector<Cell> cells;
  BlockRows rows;
  Eigen::MatrixXd dense;
};

LatticeMatrix random_matrix(const Cell& counts, double part, std::mt19937_64& random) {
  LatticeMatrix made;
  Cell cell;
  for (cell.x() = 0; cell.x() < counts.x(); ++cell.x()) {
    for (cell.y() = 0; cell.y() < counts.y(); ++cell.y()) {
      for (cell.z() = 0; cell.z() < counts.z(); ++cell.z()) {
        if (testing::random_number(0, 1, random) < part) made.cells.push_back(cell);
      }
    }
  }
  std::shuffle(made.cells.begin(), made.cells.end(), random);
  const auto count = Eigen::Index(made.cells.size());
  made.rows.resize(made.cells.size());
  made.dense.setZero(3 * count, 3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k <= i; ++k) {
      const Cell apart = made.cells[std::size_t(i)] - made.cells[std::size_t(k)];
      if (apart.cwiseAbs().maxCoeff() > 1) continue;
      Matrix3 block = Matrix3::NullaryExpr([&] { return testing::random_number(-1, 1, random); });
      if (i == k) block = Matrix3(block * block.transpose()) + 80 * Matrix3::Identity();
      made.rows[std::size_t(i)][std::int32_t(k)] = block;
      made.rows[std::size_t(k)][std::int32_t(i)] = block.transpose();
      made.dense.block<3, 3>(3 * i, 3 * k) = block;
      made.dense.block<3, 3>(3 * k, 3 * i) = block.transpose();
    }
  }
  return made;
}

TEST(NestedCholesky, SolvesLikeADenseFactor) {
  std::mt19937_64 random(1);
  const std::vector<std::pair<Cell, double>> cases{
      {{1, 1, 1}, 1}, {{2, 1, 1}, 1},   {{9, 1, 1}, 1},    {{5, 4, 1}, 1},  {{6, 5, 4}, 1},
      {{8, 3, 5}, 1}, {{9, 9, 4}, 0.3}, {{20, 2, 2}, 0.1}, {{3, 3, 3}, 0.9}};
  for (const auto& [counts, part] : cases) {
    const LatticeMatrix matrix = random_matrix(counts, part, random);
    const NestedCholesky factor(matrix.cells, matrix.rows);
    Eigen::MatrixXd x = Eigen::MatrixXd::Random(matrix.dense.rows(), 4);
    const Eigen::MatrixXd expected = matrix.dense.llt().solve(x);
    Eigen::VectorXd one = x.col(1);
    factor.solve_one(one);
    EXPECT_LE((one - expected.col(1)).cwiseAbs().maxCoeff(), 1e-13) << counts.transpose();
    NestedCholesky single(matrix.cells, matrix.rows);
    single.round_to_single();
    one = x.col(2);
    single.solve_one(one);
    EXPECT_LE((one - expected.col(2)).cwiseAbs().maxCoeff(), 1e-6) << counts.transpose();
    factor.solve(x);
    EXPECT_LE((x - expected).cwiseAbs().maxCoeff(), 1e-13) << counts.transpose();
  }
}

TEST(NestedCholesky, HasFewNumbers) {
  std::mt19937_64 random(2);
  const LatticeMatrix matrix = random_matrix({12, 6, 6}, 1, random);
  const NestedCholesky factor(matrix.cells, matrix.rows);
  EXPECT_LT(factor.entries(), matrix.dense.size() / 4);
}

TEST(NestedCholesky, RefusesWhatIsNotDefinite) {
  std::mt19937_64 random(3);
  LatticeMatrix matrix = random_matrix({5, 4, 3}, 1, random);
  matrix.rows[7][7] -= 200 * Matrix3::Identity();
  EXPECT_THROW(NestedCholesky(matrix.cells, matrix.rows), InvalidArgument);
  EXPECT_NO_THROW(NestedCholesky({}, {}));
}

}  // namespace
}  // namespace dyop::tissue_internal
