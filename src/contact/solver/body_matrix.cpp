// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/body_matrix.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>

#include "core/assert.h"

namespace dyop::contact_internal {
namespace {

// Bodies from which a matrix is cut into branches, and about how many, so that several threads get
// equal shares.
constexpr std::size_t kBranchBodies = 100;
constexpr std::size_t kBranches = 16;

// For A = P^-1 L U with row pivots P: A = L^-1 P and upper = U^-1. Returns false if a pivot is zero
// or not finite. Both factors rather than A^-1, whose product with a stiff block would lose all
// digits.
bool invert_factors(Matrix6& A, Matrix6& upper) {
  Matrix6 lower = Matrix6::Identity();
  for (Eigen::Index k = 0; k < 6; ++k) {
    Eigen::Index pivot = k;
    for (Eigen::Index i = k + 1; i < 6; ++i) {
      if (std::abs(A(i, k)) > std::abs(A(pivot, k))) pivot = i;
    }
    if (pivot != k) {
      A.row(k).swap(A.row(pivot));
      lower.row(k).swap(lower.row(pivot));
    }
    const Scalar inverse = 1 / A(k, k);
    if (!std::isfinite(inverse)) return false;
    Vector6 factor = Vector6::Zero();
    factor.tail(5 - k) = A.col(k).tail(5 - k) * inverse;
    for (Eigen::Index j = k + 1; j < 6; ++j) A.col(j) -= factor * A(k, j);
    for (Eigen::Index j = 0; j < 6; ++j) lower.col(j) -= factor * lower(k, j);
  }
  upper.setZero();
  for (Eigen::Index k = 6; k-- > 0;) {
    upper(k, k) = 1 / A(k, k);
    for (Eigen::Index j = k + 1; j < 6; ++j) {
      Scalar sum = 0;
      for (Eigen::Index i = k + 1; i <= j; ++i) sum += A(k, i) * upper(i, j);
      upper(k, j) = -sum * upper(k, k);
    }
  }
  A = lower;
  return true;
}

// A = L^-1 for A = L L^T. Returns false unless A is positive definite.
bool invert_factor(Matrix6& A) {
  Matrix6 inverse = Matrix6::Identity();
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (!(A(k, k) > 0)) return false;
    const Scalar scale = 1 / std::sqrt(A(k, k));
    A.col(k).tail(6 - k) *= scale;
    inverse.row(k).head(k + 1) *= scale;
    for (Eigen::Index i = k + 1; i < 6; ++i) {
      const Scalar factor = A(i, k);
      for (Eigen::Index j = k + 1; j <= i; ++j) A(i, j) -= factor * A(j, k);
      inverse.row(i).head(k + 1) -= factor * inverse.row(k).head(k + 1);
    }
  }
  A = inverse;
  return true;
}

}  // namespace

void BodyMatrix::analyse(const ContactSystem& system, std::size_t count) {
  slots_.clear();
  carried_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = system.blocks()[i];
    slots_.emplace_back(block.slot_a, block.slot_b);
    const std::span<const Carried> carried = carried_by(block);
    for (std::size_t k = 0; k < carried.size(); ++k) {
      const int slot = carried[k].slot;
      if (block.slot_a >= 0) carried_.emplace_back(block.slot_a, slot);
      if (block.slot_b >= 0) carried_.emplace_back(block.slot_b, slot);
      for (std::size_t m = 0; m < k; ++m) carried_.emplace_back(carried[m].slot, slot);
    }
  }
  const std::size_t bodies = system.velocities().size();
  if (bodies == place_.size() && slots_ == old_slots_ && carried_ == old_carried_) return;
  old_slots_ = slots_;
  old_carried_ = carried_;
  // Contacts with what does not move link nothing: the order often stays, as for a tool with jaws.
  list_pairs();
  if (bodies != place_.size() || pairs_ != old_pairs_) {
    old_pairs_ = pairs_;
    order_bodies(bodies);
    find_fill(bodies);
    find_branches(bodies);
    list_top_rows();
  }
  mixed_.assign(slots_.size(), {});
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].first < 0 || slots_[i].second < 0) continue;
    const int a = place_[std::size_t(slots_[i].first)];
    const int b = place_[std::size_t(slots_[i].second)];
    mixed_[i] = {entry_of(std::max(a, b), std::min(a, b)), a > b};
  }
}

void BodyMatrix::list_pairs() {
  pairs_.clear();
  for (const auto& [a, b] : slots_) {
    if (a >= 0 && b >= 0) pairs_.emplace_back(std::min(a, b), std::max(a, b));
  }
  for (const auto& [a, b] : carried_) pairs_.emplace_back(std::min(a, b), std::max(a, b));
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
}

void BodyMatrix::order_bodies(std::size_t count) {
  if (count == 1) {  // a tool among tissue: without the allocations below
    place_.assign(1, 0);
    return;
  }
  std::vector<Eigen::Triplet<Scalar>> links;
  for (std::size_t i = 0; i < count; ++i) links.emplace_back(int(i), int(i), 1);
  for (const auto& [a, b] : pairs_) {
    links.emplace_back(a, b, 1);
    links.emplace_back(b, a, 1);
  }
  Eigen::SparseMatrix<Scalar> graph{Eigen::Index(count), Eigen::Index(count)};
  graph.setFromTriplets(links.begin(), links.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  if (count > 0) Eigen::AMDOrdering<int>()(graph, order);
  place_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    place_[std::size_t(order.indices()[Eigen::Index(i)])] = int(i);
  }
}

// A column of L has the rows of the matrix's column, and those of every column whose first row it
// is.
void BodyMatrix::find_fill(std::size_t count) {
  columns_.resize(std::max(count, columns_.size()));
  for (std::vector<int>& rows : columns_) rows.clear();
  for (const auto& [slot_a, slot_b] : pairs_) {
    const int a = place_[std::size_t(slot_a)];
    const int b = place_[std::size_t(slot_b)];
    columns_[std::size_t(std::min(a, b))].push_back(std::max(a, b));
  }
  first_.assign(1, 0);
  rows_.clear();
  for (std::size_t j = 0; j < count; ++j) {
    std::vector<int>& rows = columns_[j];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (rows.size() > 1) {
      std::vector<int>& parent = columns_[std::size_t(rows.front())];
      parent.insert(parent.end(), rows.begin() + 1, rows.end());
    }
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    first_.push_back(rows_.size());
  }
  entries_.resize(rows_.size());
  diagonal_.resize(count);
  x_.resize(count);
}

// Moves what is below the top of the tree to the front, branch by branch: the fill stays the same.
// The top are the columns below which there is more than a branch's share of the work; what is left
// falls apart into trees, of which a branch takes as many as its share allows.
void BodyMatrix::find_branches(std::size_t count) {
  branches_.assign(1, 0);
  if (count < kBranchBodies) return;
  const auto parent_of = [&](std::size_t j) {
    return first_[j] < first_[j + 1] ? std::size_t(rows_[first_[j]]) : count;
  };
  std::vector<std::size_t> work(count + 1, 0);  // of each column and all below it; last: of all
  for (std::size_t j = 0; j < count; ++j) {
    const std::size_t length = 1 + first_[j + 1] - first_[j];
    work[j] += length * length;
    work[parent_of(j)] += work[j];
  }
  const std::size_t share = work[count] / kBranches;
  std::vector<std::size_t> branch_of(count + 1, count);  // count: the top
  std::size_t branches = 0;
  std::size_t used = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (work[j] > share || work[parent_of(j)] <= share) continue;
    branch_of[j] = branches;
    used += work[j];
    if (used > share / 2) {
      ++branches;
      used = 0;
    }
  }
  for (std::size_t j = count; j-- > 0;) {
    if (work[j] <= share && branch_of[j] == count) branch_of[j] = branch_of[parent_of(j)];
  }
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t x, std::size_t y) { return branch_of[x] < branch_of[y]; });
  std::vector<int> new_place(count);
  for (std::size_t i = 0; i < count; ++i) {
    new_place[order[i]] = int(i);
    if (i > 0 && branch_of[order[i]] != branch_of[order[i - 1]]) branches_.push_back(i);
  }
  if (branch_of[order.back()] != count) branches_.push_back(count);  // no top
  for (int& place : place_) place = new_place[std::size_t(place)];
  find_fill(count);
}

void BodyMatrix::list_top_rows() {
  const std::size_t top = branches_.back();
  top_rows_.resize(std::max(top_rows_.size(), diagonal_.size() - top));
  for (auto& row : top_rows_) row.clear();
  for (std::size_t j = 0; j < top; ++j) {
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      if (std::size_t(rows_[e]) >= top) top_rows_[std::size_t(rows_[e]) - top].emplace_back(j, e);
    }
  }
}

std::size_t BodyMatrix::entry_of(int row, int column) const {
  const auto begin = rows_.begin() + std::ptrdiff_t(first_[std::size_t(column)]);
  const auto end = rows_.begin() + std::ptrdiff_t(first_[std::size_t(column) + 1]);
  return std::size_t(std::lower_bound(begin, end, row) - rows_.begin());
}

void BodyMatrix::reset(bool is_symmetric) {
  is_symmetric_ = is_symmetric;
  if (!is_symmetric) {
    mirrored_.assign(entries_.size(), Matrix6::Zero());
    upper_.resize(diagonal_.size());
  }
  for (Matrix6& block : diagonal_) block.setIdentity();
  for (Matrix6& block : entries_) block.setZero();
}

// D has one entry. What the two bodies share is added with the one whose column it is in.
void BodyMatrix::add_row_share(const Block& block, std::size_t index, bool is_a, Scalar D) {
  const Vector6 own = (is_a ? block.G_a : block.G_b).row(0).transpose();
  const int slot = is_a ? block.slot_a : block.slot_b;
  diagonal_[std::size_t(place_[std::size_t(slot)])].noalias() += own * (D * own).transpose();
  if (block.slot_a < 0 || block.slot_b < 0 || mixed_[index].a_is_below == is_a) return;
  add_mixed_row(block, index, D);
}

void BodyMatrix::add_mixed_row(const Block& block, std::size_t index, Scalar D) {
  const auto [entry, a_is_below] = mixed_[index];
  const Vector6 below = (a_is_below ? block.G_a : block.G_b).row(0).transpose();
  const Vector6 above = (a_is_below ? block.G_b : block.G_a).row(0).transpose();
  entries_[entry].noalias() += below * (D * above).transpose();
  if (!is_symmetric_) mirrored_[entry].noalias() += above * (D * below).transpose();
}

void BodyMatrix::add_share(const Block& block, std::size_t index, bool is_a, const Matrix3& D) {
  if (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion) {
    return add_row_share(block, index, is_a, D(0, 0));
  }
  Rows6 DG_a, DG_b;
  (is_a ? DG_a : DG_b).noalias() = D * (is_a ? block.G_a : block.G_b);
  const int slot = is_a ? block.slot_a : block.slot_b;
  diagonal_[std::size_t(place_[std::size_t(slot)])].noalias() +=
      (is_a ? block.G_a : block.G_b).transpose().lazyProduct(is_a ? DG_a : DG_b);
  if (block.slot_a < 0 || block.slot_b < 0 || mixed_[index].a_is_below == is_a) return;
  (is_a ? DG_b : DG_a).noalias() = D * (is_a ? block.G_b : block.G_a);
  add_mixed(block, index, DG_a, DG_b);
}

void BodyMatrix::add_mixed(const Block& block, std::size_t index, const Rows6& DG_a,
                           const Rows6& DG_b) {
  const auto [entry, a_is_below] = mixed_[index];
  const Rows6& below = a_is_below ? block.G_a : block.G_b;
  const Rows6& above = a_is_below ? block.G_b : block.G_a;
  entries_[entry].noalias() += below.transpose().lazyProduct(a_is_below ? DG_b : DG_a);
  if (is_symmetric_) return;
  mirrored_[entry].noalias() += above.transpose().lazyProduct(a_is_below ? DG_a : DG_b);
}

// x^T D y. Of a symmetric matrix what is above the diagonal is left out.
void BodyMatrix::add_product(int slot_x, const Rows6& x, int slot_y, const Rows6& y,
                             const Matrix3& D) {
  if (slot_x < 0 || slot_y < 0) return;
  const int place_x = place_[std::size_t(slot_x)];
  const int place_y = place_[std::size_t(slot_y)];
  if (place_x < place_y && is_symmetric_) return;
  const Rows6 Dy = D * y;
  if (place_x == place_y) {
    diagonal_[std::size_t(place_x)].noalias() += x.transpose().lazyProduct(Dy);
    return;
  }
  const std::size_t entry = entry_of(std::max(place_x, place_y), std::min(place_x, place_y));
  (place_x > place_y ? entries_ : mirrored_)[entry].noalias() += x.transpose().lazyProduct(Dy);
}

void BodyMatrix::add_between(const ContactSystem& system, std::size_t i, const Vector3& left,
                             std::size_t k, const Vector3& right) {
  const Block& block = system.blocks()[i];
  const Block& other = system.blocks()[k];
  DYOP_ASSERT(block.slot_a == other.slot_a && block.slot_b == other.slot_b, i, ' ', k);
  const Vector6 a = block.G_a.transpose() * left, b = block.G_b.transpose() * left;
  const Vector6 other_a = other.G_a.transpose() * right, other_b = other.G_b.transpose() * right;
  const auto add_to_diagonal = [&](int slot, const Vector6& x, const Vector6& y) {
    if (slot >= 0) {
      diagonal_[std::size_t(place_[std::size_t(slot)])].noalias() += x * y.transpose();
    }
  };
  add_to_diagonal(block.slot_a, a, other_a);
  add_to_diagonal(block.slot_b, b, other_b);
  if (block.slot_a < 0 || block.slot_b < 0) return;
  const auto [entry, a_is_below] = mixed_[i];
  entries_[entry].noalias() += (a_is_below ? a : b) * (a_is_below ? other_b : other_a).transpose();
  mirrored_[entry].noalias() += (a_is_below ? b : a) * (a_is_below ? other_a : other_b).transpose();
}

void BodyMatrix::add_carried(const Block& block, const Matrix3& D) {
  const std::span<const Carried> carried = carried_by(block);
  for (std::size_t k = 0; k < carried.size(); ++k) {
    const int slot = carried[k].slot;
    const Rows6& G = carried[k].G;
    const auto add_both = [&](int other, const Rows6& other_G) {
      add_product(other, other_G, slot, G, D);
      add_product(slot, G, other, other_G, D);
    };
    add_product(slot, G, slot, G, D);
    add_both(block.slot_a, block.G_a);
    add_both(block.slot_b, block.G_b);
    for (std::size_t m = 0; m < k; ++m) add_both(carried[m].slot, carried[m].G);
  }
}

void BodyMatrix::add(const ContactSystem& system, std::size_t index, const Matrix3& D) {
  const Block& block = system.blocks()[index];
  if (block.kind == BlockKind::Row || block.kind == BlockKind::Torsion) {
    if (block.slot_a >= 0) add_row_share(block, index, true, D(0, 0));
    if (block.slot_b >= 0) add_row_share(block, index, false, D(0, 0));
    return;
  }
  if (block.carriers > 0) add_carried(block, D);
  Rows6 DG_a, DG_b;
  if (block.slot_a >= 0) {
    DG_a.noalias() = D * block.G_a;
    diagonal_[std::size_t(place_[std::size_t(block.slot_a)])].noalias() +=
        block.G_a.transpose().lazyProduct(DG_a);
  }
  if (block.slot_b >= 0) {
    DG_b.noalias() = D * block.G_b;
    diagonal_[std::size_t(place_[std::size_t(block.slot_b)])].noalias() +=
        block.G_b.transpose().lazyProduct(DG_b);
  }
  if (block.slot_a >= 0 && block.slot_b >= 0) add_mixed(block, index, DG_a, DG_b);
}

bool BodyMatrix::factorise(const SharedLoops& loops) {
  std::atomic<bool> is_regular = true;
  loops.each_long(branches_.size() - 1, [&](std::size_t i) {
    if (!eliminate_branch(branches_[i], branches_[i + 1])) is_regular = false;
  });
  if (!is_regular) return false;
  const std::size_t top = branches_.back();
  loops.each_long(diagonal_.size() - top, [&](std::size_t i) {
    for (const auto& [column, entry] : top_rows_[i]) add_contribution(column, entry);
  });
  for (std::size_t j = top; j < diagonal_.size(); ++j) {
    if (!eliminate_top_column(j, loops)) return false;
  }
  return true;
}

// Inverts the factors of a column's pivot and divides the entries by them.
bool BodyMatrix::eliminate(std::size_t column) {
  Matrix6& pivot = diagonal_[column];
  if (!(is_symmetric_ ? invert_factor(pivot) : invert_factors(pivot, upper_[column]))) return false;
  for (std::size_t e = first_[column]; e < first_[column + 1]; ++e) {
    const Matrix6 entry = entries_[e];
    if (is_symmetric_) {
      entries_[e].noalias() = entry.lazyProduct(pivot.transpose());
    } else {
      const Matrix6 mirrored = mirrored_[e];
      entries_[e].noalias() = entry.lazyProduct(upper_[column]);
      mirrored_[e].noalias() = pivot.lazyProduct(mirrored);
    }
  }
  return true;
}

// Subtracts what an eliminated column contributes to the one in whose row its entry is.
void BodyMatrix::add_contribution(std::size_t column, std::size_t entry) {
  const std::size_t target = std::size_t(rows_[entry]);
  const Matrix6& right = is_symmetric_ ? entries_[entry] : mirrored_[entry];
  if (is_symmetric_) {
    diagonal_[target].noalias() -= entries_[entry].lazyProduct(right.transpose());
  } else {
    diagonal_[target].noalias() -= entries_[entry].lazyProduct(right);
  }
  std::size_t at = first_[target];
  for (std::size_t below = entry + 1; below < first_[column + 1]; ++below) {
    while (rows_[at] != rows_[below]) ++at;
    if (is_symmetric_) {
      entries_[at].noalias() -= entries_[below].lazyProduct(right.transpose());
    } else {
      entries_[at].noalias() -= entries_[below].lazyProduct(right);
      mirrored_[at].noalias() -= entries_[entry].lazyProduct(mirrored_[below]);
    }
  }
}

// Without what its columns contribute to the top.
bool BodyMatrix::eliminate_branch(std::size_t begin, std::size_t end) {
  for (std::size_t j = begin; j < end; ++j) {
    if (!eliminate(j)) return false;
    for (std::size_t e = first_[j]; e < first_[j + 1] && std::size_t(rows_[e]) < end; ++e) {
      add_contribution(j, e);
    }
  }
  return true;
}

bool BodyMatrix::eliminate_top_column(std::size_t column, const SharedLoops& loops) {
  constexpr std::size_t kLongColumn = 8;  // shorter ones are not worth sharing
  if (!eliminate(column)) return false;
  const std::size_t first = first_[column];
  const std::size_t count = first_[column + 1] - first;
  if (count < kLongColumn) {
    for (std::size_t i = 0; i < count; ++i) add_contribution(column, first + i);
  } else {
    loops.each_long(count, [&](std::size_t i) { add_contribution(column, first + i); });
  }
  return true;
}

// Columns from `begin` on, and their part in rows before `end`.
void BodyMatrix::solve_forward(std::size_t begin, std::size_t end) {
  for (std::size_t j = begin; j < end; ++j) {
    const Vector6 here = diagonal_[j] * x_[j];
    x_[j] = here;
    for (std::size_t e = first_[j]; e < first_[j + 1] && std::size_t(rows_[e]) < end; ++e) {
      x_[std::size_t(rows_[e])].noalias() -= entries_[e] * here;
    }
  }
}

void BodyMatrix::solve_back(std::size_t begin, std::size_t end) {
  for (std::size_t j = end; j-- > begin;) {
    Vector6 here = x_[j];
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      const Vector6& there = x_[std::size_t(rows_[e])];
      if (is_symmetric_) {
        here.noalias() -= entries_[e].transpose() * there;
      } else {
        here.noalias() -= mirrored_[e] * there;
      }
    }
    if (is_symmetric_) {
      x_[j].noalias() = diagonal_[j].transpose() * here;
    } else {
      x_[j].noalias() = upper_[j] * here;
    }
  }
}

void BodyMatrix::solve(std::vector<Vector6>& x, const SharedLoops& loops) {
  for (std::size_t i = 0; i < x.size(); ++i) x_[std::size_t(place_[i])] = x[i];
  const std::size_t top = branches_.back();
  loops.each_long(branches_.size() - 1,
                  [&](std::size_t i) { solve_forward(branches_[i], branches_[i + 1]); });
  for (std::size_t i = top; i < x_.size(); ++i) {
    for (const auto& [column, entry] : top_rows_[i - top]) {
      x_[i].noalias() -= entries_[entry] * x_[column];
    }
  }
  solve_forward(top, x_.size());
  solve_back(top, x_.size());
  loops.each_long(branches_.size() - 1,
                  [&](std::size_t i) { solve_back(branches_[i], branches_[i + 1]); });
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = x_[std::size_t(place_[i])];
}

}  // namespace dyop::contact_internal
