// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>
#include <vector>

#include "contact/solver/contact_system.h"

namespace dyop::contact_internal {

using Matrix6 = Eigen::Matrix<Scalar, 6, 6>;

// The matrix I + sum of G^T D G over the blocks of a system, with a 6x6 block for every body and
// every pair of bodies that share one, and its block factorisation, with the bodies in approximate
// minimum degree order: Cholesky for symmetric D, or LU, at twice the cost, for any D. Nothing is
// allocated while the same bodies are linked and no more memory is needed than before.
//
// Columns depend on those below them in the elimination tree ([Liu1990]). The order begins with
// branches of it, which are eliminated at the same time, and ends with the top that joins them;
// every entry takes the contributions of earlier columns in their order, whoever adds them.
class BodyMatrix {
 public:
  // Finds the pattern and its fill for the first `count` blocks, or all; kept while every block has
  // the same bodies.
  void analyse(const ContactSystem& system, std::size_t count);
  void analyse(const ContactSystem& system) { analyse(system, system.blocks().size()); }

  // Sets the matrix to the identity, and chooses symmetric or general.
  void reset(bool is_symmetric = true);

  // Adds G^T D G for the block with that index. Of a joint's row and of torsion only the first entry
  // of D counts.
  void add(const ContactSystem& system, std::size_t index, const Matrix3& D);

  // Adds that for all blocks, with the bodies shared among the system's team: D(i) is called for
  // each of a block's bodies. For every entry in the order of the blocks, so with the same bits.
  template <typename Derivative>
  void add_all(const ContactSystem& system, const Derivative& D);

  // Adds G_i^T left right^T G_k for two blocks of the same bodies, to a general matrix.
  void add_between(const ContactSystem& system, std::size_t i, const Vector3& left, std::size_t k,
                   const Vector3& right);

  // Factorises in place. Returns false if a symmetric matrix is not positive definite, or a general
  // one has a singular pivot.
  bool factorise(const SharedLoops& loops);

  // x = H^-1 x, one entry per body.
  void solve(std::vector<Vector6>& x, const SharedLoops& loops);

 private:
  // Where the off-diagonal part of a block goes, and whether it holds the rows of a.
  struct Mixed {
    std::size_t entry = 0;
    bool a_is_below = true;
  };

  void add_share(const Block& block, std::size_t index, bool is_a, const Matrix3& D);
  void add_row_share(const Block& block, std::size_t index, bool is_a, Scalar D);
  void add_mixed(const Block& block, std::size_t index, const Rows6& DG_a, const Rows6& DG_b);
  void add_mixed_row(const Block& block, std::size_t index, Scalar D);
  void add_carried(const Block& block, const Matrix3& D);
  void add_product(int slot_x, const Rows6& x, int slot_y, const Rows6& y, const Matrix3& D);
  void list_pairs();
  void order_bodies(std::size_t count);
  void find_fill(std::size_t count);
  std::size_t entry_of(int row, int column) const;
  void find_branches(std::size_t count);
  void list_top_rows();
  bool eliminate(std::size_t column);
  void add_contribution(std::size_t column, std::size_t entry);
  bool eliminate_branch(std::size_t begin, std::size_t end);
  bool eliminate_top_column(std::size_t column, const SharedLoops& loops);
  void solve_forward(std::size_t begin, std::size_t end);
  void solve_back(std::size_t begin, std::size_t end);

  std::vector<std::pair<int, int>> slots_, old_slots_;  // by block of the system
  // Further ones that share a block, through carriers.
  std::vector<std::pair<int, int>> carried_, old_carried_;
  std::vector<std::pair<int, int>> pairs_, old_pairs_;  // of bodies that share a block, ascending
  std::vector<int> place_;                              // by body: its position in the order
  std::vector<std::size_t> first_;         // by column: entry of its first block below the diagonal
  std::vector<int> rows_;                  // by entry, ascending within a column
  std::vector<std::vector<int>> columns_;  // memory of find_fill()
  std::vector<std::size_t> branches_{0};   // where branches begin, and last, the top
  // By column of the top: its entries in columns of branches, ascending, as (column, entry).
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> top_rows_;
  std::vector<Matrix6> entries_;   // below the diagonal
  std::vector<Matrix6> mirrored_;  // above it, mirrored; general matrices only
  std::vector<Matrix6> diagonal_;  // after factorise(): inverses of L's blocks
  std::vector<Matrix6> upper_;     // and of U's; general matrices only
  bool is_symmetric_ = true;
  std::vector<Mixed> mixed_;
  std::vector<Vector6> x_;
};

template <typename Derivative>
void BodyMatrix::add_all(const ContactSystem& system, const Derivative& D) {
  if (!system.loops().has_team()) {
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      const Matrix3& D_i = D(i);
      if (!D_i.isZero(0)) add(system, i, D_i);
    }
    return;
  }
  system.loops().each(place_.size(), [&](std::size_t slot) {
    for (const ContactSystem::Share& share : system.shares_of(slot)) {
      const Matrix3& D_i = D(share.block);
      if (D_i.isZero(0)) continue;
      add_share(system.blocks()[share.block], share.block, share.is_a, D_i);
    }
  });
}

}  // namespace dyop::contact_internal
