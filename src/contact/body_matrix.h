#pragma once

#include <utility>
#include <vector>

#include "contact/contact_system.h"

namespace dyop::internal {

using Matrix6 = Eigen::Matrix<Scalar, 6, 6>;

// The matrix I + sum of G^T D G over the blocks of a system, a 6x6 block for every body and every
// pair of bodies that share one, and its Cholesky factorisation L L^T in blocks, bodies ordered by
// approximate minimum degree. Nothing is allocated while the pattern stays the same.
class BodyMatrix {
 public:
  // Finds pattern and fill; kept while the bodies of every block stay the same.
  void analyse(const ContactSystem& system);

  // Sets the matrix to the identity.
  void reset();

  // Adds G^T D G for the block of that index; D symmetric.
  void add(const ContactSystem& system, std::size_t index, const Matrix3& D);

  // Factorises in place. Returns false if the matrix is not positive definite, which rounding or
  // overflow may cause.
  bool factorise();

  // x = H^-1 x, one entry a body.
  void solve(std::vector<Vector6>& x);

 private:
  // Where the mixed part of a block goes, and whether it is G_a^T D G_b there or its transpose.
  struct Mixed {
    std::size_t entry = 0;
    bool has_rows_of_a = true;
  };

  void order_bodies(std::size_t count);
  void find_fill(std::size_t count);
  std::size_t entry_of(int row, int column) const;

  std::vector<std::pair<int, int>> slots_, old_slots_;  // of every block of the system
  std::vector<int> place_;                              // in the order, of every body
  std::vector<std::size_t> first_;  // entry of each column's first block below the diagonal
  std::vector<int> rows_;           // of every entry, ascending in a column
  std::vector<Matrix6> entries_;    // below the diagonal
  std::vector<Matrix6> diagonal_;   // after factorise(): inverses of L's diagonal blocks
  std::vector<Mixed> mixed_;
  std::vector<Vector6> x_;
};

}  // namespace dyop::internal
