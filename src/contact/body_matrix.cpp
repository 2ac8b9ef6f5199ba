#include "contact/body_matrix.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace dyop::internal {

void BodyMatrix::analyse(const ContactSystem& system) {
  slots_.clear();
  for (const Block& block : system.blocks()) slots_.emplace_back(block.slot_a, block.slot_b);
  const std::size_t count = system.velocities().size();
  if (count == place_.size() && slots_ == old_slots_) return;
  old_slots_ = slots_;
  order_bodies(count);
  find_fill(count);
  mixed_.assign(slots_.size(), {});
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].first < 0 || slots_[i].second < 0) continue;
    const int a = place_[std::size_t(slots_[i].first)];
    const int b = place_[std::size_t(slots_[i].second)];
    mixed_[i] = {entry_of(std::max(a, b), std::min(a, b)), a > b};
  }
}

void BodyMatrix::order_bodies(std::size_t count) {
  std::vector<Eigen::Triplet<Scalar>> links;
  for (std::size_t i = 0; i < count; ++i) links.emplace_back(int(i), int(i), 1);
  for (const auto& [a, b] : slots_) {
    if (a < 0 || b < 0) continue;
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

// A column of L has the rows of the matrix's column and those of the columns that it is the first
// row of.
void BodyMatrix::find_fill(std::size_t count) {
  std::vector<std::vector<int>> columns(count);
  for (const auto& [slot_a, slot_b] : slots_) {
    if (slot_a < 0 || slot_b < 0) continue;
    const int a = place_[std::size_t(slot_a)];
    const int b = place_[std::size_t(slot_b)];
    columns[std::size_t(std::min(a, b))].push_back(std::max(a, b));
  }
  first_.assign(1, 0);
  rows_.clear();
  for (std::size_t j = 0; j < count; ++j) {
    std::vector<int>& rows = columns[j];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (rows.size() > 1) {
      std::vector<int>& parent = columns[std::size_t(rows.front())];
      parent.insert(parent.end(), rows.begin() + 1, rows.end());
    }
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    first_.push_back(rows_.size());
  }
  entries_.resize(rows_.size());
  diagonal_.resize(count);
  x_.resize(count);
}

std::size_t BodyMatrix::entry_of(int row, int column) const {
  const auto begin = rows_.begin() + std::ptrdiff_t(first_[std::size_t(column)]);
  const auto end = rows_.begin() + std::ptrdiff_t(first_[std::size_t(column) + 1]);
  return std::size_t(std::lower_bound(begin, end, row) - rows_.begin());
}

void BodyMatrix::reset() {
  for (Matrix6& block : diagonal_) block.setIdentity();
  for (Matrix6& block : entries_) block.setZero();
}

void BodyMatrix::add(const ContactSystem& system, std::size_t index, const Matrix3& D) {
  const Block& block = system.blocks()[index];
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
  if (block.slot_a < 0 || block.slot_b < 0) return;
  Matrix6& entry = entries_[mixed_[index].entry];
  if (mixed_[index].has_rows_of_a) {
    entry.noalias() += block.G_a.transpose().lazyProduct(DG_b);
  } else {
    entry.noalias() += block.G_b.transpose().lazyProduct(DG_a);
  }
}

bool BodyMatrix::factorise() {
  for (std::size_t j = 0; j < diagonal_.size(); ++j) {
    const Eigen::LLT<Matrix6> pivot(diagonal_[j]);
    if (pivot.info() != Eigen::Success) return false;  // also NaN
    diagonal_[j] = pivot.matrixL().solve(Matrix6::Identity());
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      const Matrix6 entry = entries_[e];
      entries_[e].noalias() = entry.lazyProduct(diagonal_[j].transpose());
    }
    // What column j does to those after it.
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      const std::size_t column = std::size_t(rows_[e]);
      diagonal_[column].noalias() -= entries_[e].lazyProduct(entries_[e].transpose());
      std::size_t at = first_[column];
      for (std::size_t below = e + 1; below < first_[j + 1]; ++below) {
        while (rows_[at] != rows_[below]) ++at;
        entries_[at].noalias() -= entries_[below].lazyProduct(entries_[e].transpose());
      }
    }
  }
  return true;
}

void BodyMatrix::solve(std::vector<Vector6>& x) {
  for (std::size_t i = 0; i < x.size(); ++i) x_[std::size_t(place_[i])] = x[i];
  for (std::size_t j = 0; j < x_.size(); ++j) {
    const Vector6 here = diagonal_[j] * x_[j];
    x_[j] = here;
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      x_[std::size_t(rows_[e])].noalias() -= entries_[e] * here;
    }
  }
  for (std::size_t j = x_.size(); j-- > 0;) {
    Vector6 here = x_[j];
    for (std::size_t e = first_[j]; e < first_[j + 1]; ++e) {
      here.noalias() -= entries_[e].transpose() * x_[std::size_t(rows_[e])];
    }
    x_[j].noalias() = diagonal_[j].transpose() * here;
  }
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = x_[std::size_t(place_[i])];
}

}  // namespace dyop::internal
