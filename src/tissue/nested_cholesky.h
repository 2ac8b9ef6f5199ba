// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::tissue_internal {

using Cell = Eigen::Vector3i;

/// A symmetric matrix of 3 x 3 blocks between nodes of a lattice: per node the blocks of its row.
using BlockRows = std::vector<std::map<std::int32_t, Matrix3>>;

/// Cholesky factor of a symmetric positive definite matrix whose blocks join only nodes that are
/// neighbours in a lattice (26 around each). Ordered by nested dissection: a plane of nodes parts
/// the rest, and so on [George1973]; factorised front by front in dense blocks [Duff1983].
class NestedCholesky {
 public:
  NestedCholesky() = default;
  /// @param cells Place of each node in the lattice.
  /// @throws InvalidArgument if the matrix is not positive definite.
  NestedCholesky(const std::vector<Cell>& cells, const BlockRows& matrix);

  /// Keeps the factor in single precision from now on: half the memory, and solves twice as fast, for
  /// matrices of a condition below about a million.
  void round_to_single();

  /// Overwrites every column of `x`, three rows a node, by the solution of A x = column.
  void solve(Eigen::Ref<Eigen::MatrixXd> x) const;
  /// The same for one column, which is much faster than solve().
  void solve_one(Eigen::Ref<Eigen::VectorXd> x) const;

  std::int64_t entries() const;  ///< numbers in the factor

 private:
  // Nodes that are eliminated together, and the nodes eliminated later that their rows reach.
  struct Front {
    std::vector<std::int32_t> own;
    std::vector<std::int32_t> later;  // in order of elimination
    std::array<std::int32_t, 2> children{-1, -1};
    Eigen::MatrixXd lower;  // of the own block
    Eigen::MatrixXd below;  // the rows of `later`
    Eigen::MatrixXf single_lower;
    Eigen::MatrixXf single_below;
  };

  template <typename Columns>
  void solve_ordered(Columns& x) const;
  template <int kColumns>
  void solve_all(Eigen::Ref<Eigen::Matrix<Scalar, Eigen::Dynamic, kColumns>> x) const;
  std::int32_t dissect(const std::vector<Cell>& cells, std::vector<std::int32_t> nodes);
  void find_later(const BlockRows& matrix);
  void factorise(const BlockRows& matrix);
  Eigen::MatrixXd assemble(const BlockRows& matrix, const Front& front,
                           std::vector<Eigen::MatrixXd>& updates) const;
  // For each of a child's later nodes its number among the front's own, then later ones.
  std::vector<std::int32_t> places(const Front& child, const Front& front) const;

  std::vector<Front> fronts_;        // children before parents
  std::vector<std::int32_t> order_;  // of elimination, by node
  bool is_single_ = false;
};

}  // namespace dyop::tissue_internal
