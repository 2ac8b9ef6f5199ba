#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <vector>

#include "contact/contact_system.h"

namespace dyop::internal {

// The matrix I + sum of G^T D G over the blocks of a system, a 6x6 block for every body and every
// pair of bodies that share a block, and its Cholesky factorisation: dense for few bodies, else
// sparse with bodies ordered by approximate minimum degree.
class BodyMatrix {
 public:
  // Finds the pattern; the symbolic factorisation is kept while that stays the same.
  void analyse(const ContactSystem& system);

  // Sets the matrix to the identity.
  void reset();

  // Adds G^T D G for the block of that index; D symmetric.
  void add(const ContactSystem& system, std::size_t index, const Matrix3& D);

  // Returns whether the factorisation exists, which rounding or overflow may prevent.
  bool factorise();

  // x = H^-1 x, one entry a body.
  void solve(std::vector<Vector6>& x);

 private:
  using Sparse = Eigen::SparseMatrix<Scalar>;
  using Pair = std::pair<int, int>;  // places of two bodies in the order, first <= second

  // Where the 6x6 block of two bodies begins in the values, and how far its columns are apart.
  struct Place {
    Eigen::Index start = 0;
    Eigen::Index stride = 0;
  };
  // The three places a block of the system adds to, and whether the mixed one holds a's rows.
  struct Target {
    Place aa, bb, ab;
    bool a_is_first = true;
  };

  void order_bodies(std::size_t count);
  void build_pattern(std::size_t count);
  Place place_of(int row, int column) const;
  void add_at(const Place& place, const Eigen::Matrix<Scalar, 6, 6>& block);

  bool is_dense_ = true;
  std::size_t body_count_ = 0;
  std::vector<Pair> slots_, old_slots_;  // of every block, as slots
  std::vector<int> place_of_slot_;
  std::vector<std::vector<int>> rows_of_column_;  // places <= column, ascending
  std::vector<Target> targets_;
  Sparse sparse_;  // upper part
  Eigen::SimplicialLLT<Sparse, Eigen::Upper, Eigen::NaturalOrdering<int>> factor_;
  Eigen::MatrixXd dense_;
  Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> dense_factor_;
  Eigen::VectorXd x_;
};

}  // namespace dyop::internal
