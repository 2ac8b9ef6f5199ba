#include "contact/body_matrix.h"

#include <Eigen/OrderingMethods>
#include <algorithm>

#include "dyop/core/tolerance.h"

namespace dyop::internal {

void BodyMatrix::analyse(const ContactSystem& system) {
  slots_.clear();
  for (const Block& block : system.blocks()) slots_.emplace_back(block.slot_a, block.slot_b);
  const std::size_t count = system.velocities().size();
  if (count == body_count_ && slots_ == old_slots_) return;
  body_count_ = count;
  old_slots_ = slots_;
  is_dense_ = count <= kContactDenseBodies;
  place_of_slot_.resize(count);
  if (is_dense_) {
    for (std::size_t i = 0; i < count; ++i) place_of_slot_[i] = int(i);
    dense_.resize(6 * Eigen::Index(count), 6 * Eigen::Index(count));
  } else {
    order_bodies(count);
    build_pattern(count);
    factor_.analyzePattern(sparse_);
  }
  targets_.clear();
  for (const Pair& pair : slots_) {
    Target target;
    const int a = pair.first < 0 ? -1 : place_of_slot_[std::size_t(pair.first)];
    const int b = pair.second < 0 ? -1 : place_of_slot_[std::size_t(pair.second)];
    if (a >= 0) target.aa = place_of(a, a);
    if (b >= 0) target.bb = place_of(b, b);
    target.a_is_first = a <= b;
    if (a >= 0 && b >= 0) target.ab = place_of(std::min(a, b), std::max(a, b));
    targets_.push_back(target);
  }
}

void BodyMatrix::order_bodies(std::size_t count) {
  std::vector<Eigen::Triplet<Scalar>> entries;
  for (std::size_t i = 0; i < count; ++i) entries.emplace_back(int(i), int(i), 1);
  for (const auto& [a, b] : slots_) {
    if (a < 0 || b < 0) continue;
    entries.emplace_back(a, b, 1);
    entries.emplace_back(b, a, 1);
  }
  Sparse graph{Eigen::Index(count), Eigen::Index(count)};
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType order;
  Eigen::AMDOrdering<int>()(graph, order);
  for (std::size_t i = 0; i < count; ++i) {
    place_of_slot_[std::size_t(order.indices()[Eigen::Index(i)])] = int(i);
  }
}

void BodyMatrix::build_pattern(std::size_t count) {
  rows_of_column_.assign(count, {});
  for (std::size_t i = 0; i < count; ++i) rows_of_column_[i].push_back(int(i));
  for (const auto& [slot_a, slot_b] : slots_) {
    if (slot_a < 0 || slot_b < 0) continue;
    const int a = place_of_slot_[std::size_t(slot_a)];
    const int b = place_of_slot_[std::size_t(slot_b)];
    rows_of_column_[std::size_t(std::max(a, b))].push_back(std::min(a, b));
  }
  std::size_t blocks = 0;
  for (std::vector<int>& rows : rows_of_column_) {
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    blocks += rows.size();
  }
  const Eigen::Index size = 6 * Eigen::Index(count);
  sparse_.resize(size, size);
  sparse_.resizeNonZeros(36 * Eigen::Index(blocks));
  int* inner = sparse_.innerIndexPtr();
  int* outer = sparse_.outerIndexPtr();
  int next = 0;
  for (std::size_t column = 0; column < count; ++column) {
    for (std::size_t c = 0; c < 6; ++c) {
      outer[6 * column + c] = next;
      for (const int row : rows_of_column_[column]) {
        for (int r = 0; r < 6; ++r) inner[next++] = 6 * row + r;
      }
    }
  }
  outer[6 * count] = next;
}

BodyMatrix::Place BodyMatrix::place_of(int row, int column) const {
  if (is_dense_) return {6 * column * dense_.rows() + 6 * row, dense_.rows()};
  const std::vector<int>& rows = rows_of_column_[std::size_t(column)];
  const auto at = std::lower_bound(rows.begin(), rows.end(), row);
  return {sparse_.outerIndexPtr()[6 * column] + 6 * (at - rows.begin()),
          6 * Eigen::Index(rows.size())};
}

void BodyMatrix::reset() {
  if (is_dense_) {
    dense_.setIdentity();
    return;
  }
  std::fill_n(sparse_.valuePtr(), sparse_.nonZeros(), Scalar{0});
  for (std::size_t i = 0; i < body_count_; ++i) {
    add_at(place_of(int(i), int(i)), Eigen::Matrix<Scalar, 6, 6>::Identity());
  }
}

void BodyMatrix::add_at(const Place& place, const Eigen::Matrix<Scalar, 6, 6>& block) {
  Scalar* values = (is_dense_ ? dense_.data() : sparse_.valuePtr()) + place.start;
  Eigen::Map<Eigen::Matrix<Scalar, 6, 6>, 0, Eigen::OuterStride<>>(
      values, Eigen::OuterStride<>(place.stride)) += block;
}

void BodyMatrix::add(const ContactSystem& system, std::size_t index, const Matrix3& D) {
  const Block& block = system.blocks()[index];
  const Target& target = targets_[index];
  const Rows6 DG_b = D * block.G_b;
  if (block.slot_b >= 0) add_at(target.bb, block.G_b.transpose() * DG_b);
  if (block.slot_a < 0) return;
  const Rows6 DG_a = D * block.G_a;
  add_at(target.aa, block.G_a.transpose() * DG_a);
  if (block.slot_b < 0) return;
  if (target.a_is_first) {
    add_at(target.ab, block.G_a.transpose() * DG_b);
  } else {
    add_at(target.ab, block.G_b.transpose() * DG_a);
  }
}

bool BodyMatrix::factorise() {
  if (is_dense_) {
    dense_factor_.compute(dense_);
    return dense_factor_.info() == Eigen::Success;
  }
  factor_.factorize(sparse_);
  return factor_.info() == Eigen::Success;
}

void BodyMatrix::solve(std::vector<Vector6>& x) {
  x_.resize(6 * Eigen::Index(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    x_.segment<6>(6 * place_of_slot_[i]) = x[i];
  }
  if (is_dense_) {
    dense_factor_.solveInPlace(x_);
  } else {
    factor_.matrixL().solveInPlace(x_);
    factor_.matrixU().solveInPlace(x_);
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = x_.segment<6>(6 * place_of_slot_[i]);
  }
}

}  // namespace dyop::internal
