// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/nested_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <set>
#include <type_traits>

#include "dyop/core/error.h"

namespace dyop::tissue_internal {
namespace {

// Fewer nodes are not divided: their dense block is cheaper than more fronts.
constexpr std::size_t kLeafNodes = 18;

using Eigen::Index;

}  // namespace

NestedCholesky::NestedCholesky(const std::vector<Cell>& cells, const BlockRows& matrix)
    : order_(cells.size()) {
  if (cells.empty()) return;
  std::vector<std::int32_t> all(cells.size());
  std::iota(all.begin(), all.end(), 0);
  dissect(cells, std::move(all));
  std::int32_t next = 0;
  for (const Front& front : fronts_) {
    for (const std::int32_t node : front.own) order_[std::size_t(node)] = next++;
  }
  find_later(matrix);
  factorise(matrix);
}

// Returns the number of the last front made: the root of these nodes; -1 if there are none.
std::int32_t NestedCholesky::dissect(const std::vector<Cell>& cells,
                                     std::vector<std::int32_t> nodes) {
  if (nodes.empty()) return -1;
  Eigen::AlignedBox3i box;
  for (const std::int32_t node : nodes) box.extend(cells[std::size_t(node)]);
  int axis = 0;
  const int longest = box.sizes().maxCoeff(&axis);
  Front front;
  if (nodes.size() <= kLeafNodes || longest < 2) {
    front.own = std::move(nodes);
  } else {
    std::vector<int> places;
    for (const std::int32_t node : nodes) places.push_back(cells[std::size_t(node)][axis]);
    const auto middle = places.begin() + std::ptrdiff_t(places.size() / 2);
    std::nth_element(places.begin(), middle, places.end());
    // Not an end: both sides must be smaller.
    const int plane = std::clamp(*middle, box.min()[axis] + 1, box.max()[axis] - 1);
    std::array<std::vector<std::int32_t>, 2> sides;
    for (const std::int32_t node : nodes) {
      const int place = cells[std::size_t(node)][axis];
      (place == plane ? front.own : sides[place > plane]).push_back(node);
    }
    for (std::size_t k = 0; k < 2; ++k) front.children[k] = dissect(cells, std::move(sides[k]));
    // Nothing lies in the plane: the last child takes its place.
    if (front.own.empty() && front.children[0] < 0) return front.children[1];
    if (front.own.empty() && front.children[1] < 0) return front.children[0];
  }
  fronts_.push_back(std::move(front));
  return std::int32_t(fronts_.size()) - 1;
}

void NestedCholesky::find_later(const BlockRows& matrix) {
  const auto before = [&](std::int32_t a, std::int32_t b) {
    return order_[std::size_t(a)] < order_[std::size_t(b)];
  };
  std::int32_t end = 0;
  for (Front& front : fronts_) {
    end += std::int32_t(front.own.size());
    std::set<std::int32_t, decltype(before)> later(before);
    const auto add = [&](std::int32_t node) {
      if (order_[std::size_t(node)] >= end) later.insert(node);
    };
    for (const std::int32_t node : front.own) {
      for (const auto& [other, block] : matrix[std::size_t(node)]) add(other);
    }
    for (const std::int32_t child : front.children) {
      if (child < 0) continue;
      for (const std::int32_t node : fronts_[std::size_t(child)].later) add(node);
    }
    front.later.assign(later.begin(), later.end());
  }
}

std::vector<std::int32_t> NestedCholesky::places(const Front& child, const Front& front) const {
  std::vector<std::int32_t> found;
  const std::int32_t first = front.own.empty() ? 0 : order_[std::size_t(front.own[0])];
  const auto own_count = std::int32_t(front.own.size());
  std::size_t next = 0;
  for (const std::int32_t node : child.later) {
    const std::int32_t place = order_[std::size_t(node)] - first;
    if (!front.own.empty() && place < own_count) {
      found.push_back(place);
      continue;
    }
    while (front.later[next] != node) ++next;
    found.push_back(own_count + std::int32_t(next));
  }
  return found;
}

Eigen::MatrixXd NestedCholesky::assemble(const BlockRows& matrix, const Front& front,
                                         std::vector<Eigen::MatrixXd>& updates) const {
  const Index own = Index(front.own.size());
  const Index size = 3 * (own + Index(front.later.size()));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  std::map<std::int32_t, Index> place_of;
  for (std::size_t i = 0; i < front.own.size(); ++i) place_of[front.own[i]] = Index(i);
  for (std::size_t i = 0; i < front.later.size(); ++i) place_of[front.later[i]] = own + Index(i);
  for (std::size_t k = 0; k < front.own.size(); ++k) {
    for (const auto& [other, block] : matrix[std::size_t(front.own[k])]) {
      const auto found = place_of.find(other);  // none: eliminated earlier
      if (found != place_of.end() && found->second >= Index(k)) {
        sum.block<3, 3>(3 * found->second, 3 * Index(k)) += block.transpose();
      }
    }
  }
  for (const std::int32_t child : front.children) {
    if (child < 0) continue;
    Eigen::MatrixXd& update = updates[std::size_t(child)];
    const std::vector<std::int32_t> to = places(fronts_[std::size_t(child)], front);
    for (std::size_t column = 0; column < to.size(); ++column) {
      for (std::size_t row = column; row < to.size(); ++row) {
        sum.block<3, 3>(3 * to[row], 3 * to[column]) +=
            update.block<3, 3>(3 * Index(row), 3 * Index(column));
      }
    }
    update = {};
  }
  return sum;
}

void NestedCholesky::factorise(const BlockRows& matrix) {
  std::vector<Eigen::MatrixXd> updates(fronts_.size());
  for (std::size_t k = 0; k < fronts_.size(); ++k) {
    Front& front = fronts_[k];
    Eigen::MatrixXd sum = assemble(matrix, front, updates);
    const Index own = 3 * Index(front.own.size()), rest = sum.rows() - own;
    front.lower = sum.topLeftCorner(own, own).selfadjointView<Eigen::Lower>();
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(front.lower);
    DYOP_REQUIRE(factor.info() == Eigen::Success,
                 "NestedCholesky: the matrix is not positive definite");
    front.below = sum.bottomLeftCorner(rest, own);
    if (rest == 0) continue;  // Eigen's solver would bind a reference to nothing
    front.lower.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
        front.below);
    updates[k] = sum.bottomRightCorner(rest, rest);
    updates[k].selfadjointView<Eigen::Lower>().rankUpdate(front.below, -1);
  }
}

void NestedCholesky::round_to_single() {
  if (is_single_) return;
  is_single_ = true;
  for (Front& front : fronts_) {
    front.single_lower = front.lower.cast<float>();
    front.single_below = front.below.cast<float>();
    front.lower = {};
    front.below = {};
  }
}

// In the order of elimination a front's own rows are beside each other.
template <typename Columns>
void NestedCholesky::solve_ordered(Columns& x) const {
  const auto lower_of = [](const Front& front) -> const auto& {
    if constexpr (std::is_same_v<typename Columns::Scalar, float>) {
      return front.single_lower;
    } else {
      return front.lower;
    }
  };
  const auto below_of = [](const Front& front) -> const auto& {
    if constexpr (std::is_same_v<typename Columns::Scalar, float>) {
      return front.single_below;
    } else {
      return front.below;
    }
  };
  Columns later;
  Index first = 0;
  for (const Front& front : fronts_) {
    const Index count = 3 * Index(front.own.size());
    auto own = x.middleRows(first, count);
    lower_of(front).template triangularView<Eigen::Lower>().solveInPlace(own);
    later.noalias() = below_of(front) * own;
    for (std::size_t i = 0; i < front.later.size(); ++i) {
      x.template middleRows<3>(3 * order_[std::size_t(front.later[i])]) -=
          later.template middleRows<3>(3 * Index(i));
    }
    first += count;
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const Index count = 3 * Index(front->own.size());
    first -= count;
    later.resize(3 * Index(front->later.size()), x.cols());
    for (std::size_t i = 0; i < front->later.size(); ++i) {
      later.template middleRows<3>(3 * Index(i)) =
          x.template middleRows<3>(3 * order_[std::size_t(front->later[i])]);
    }
    auto own = x.middleRows(first, count);
    own.noalias() -= below_of(*front).transpose() * later;
    lower_of(*front).template triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
}

template <int kColumns>
void NestedCholesky::solve_all(
    Eigen::Ref<Eigen::Matrix<Scalar, Eigen::Dynamic, kColumns>> x) const {
  const auto run = [&]<typename Number>(Number) {
    Eigen::Matrix<Number, Eigen::Dynamic, kColumns> ordered(x.rows(), x.cols());
    for (std::size_t n = 0; n < order_.size(); ++n) {
      ordered.template middleRows<3>(3 * order_[n]) =
          x.template middleRows<3>(3 * Index(n)).template cast<Number>();
    }
    solve_ordered(ordered);
    for (std::size_t n = 0; n < order_.size(); ++n) {
      x.template middleRows<3>(3 * Index(n)) =
          ordered.template middleRows<3>(3 * order_[n]).template cast<Scalar>();
    }
  };
  if (is_single_) {
    run(float{});
  } else {
    run(Scalar{});
  }
}

void NestedCholesky::solve(Eigen::Ref<Eigen::MatrixXd> x) const {
  solve_all<Eigen::Dynamic>(x);
}

void NestedCholesky::solve_one(Eigen::Ref<Eigen::VectorXd> x) const {
  solve_all<1>(x);
}

std::int64_t NestedCholesky::entries() const {
  std::int64_t count = 0;
  for (const Front& front : fronts_) {
    const Index own = 3 * Index(front.own.size());
    count += own * (own + 3 * Index(front.later.size()));
  }
  return count;
}

}  // namespace dyop::tissue_internal
