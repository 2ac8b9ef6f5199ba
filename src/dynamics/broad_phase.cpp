// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/broad_phase.h"

#include <algorithm>
#include <cmath>

namespace dyop::internal {
namespace {

std::size_t index_of(std::int32_t number) {
  return static_cast<std::size_t>(number);
}

}  // namespace

std::int32_t BroadPhase::add(const AlignedBox& box) {
  const auto number = static_cast<std::int32_t>(boxes_.size());
  boxes_.push_back(box);
  order_.push_back(number);
  return number;
}

void BroadPhase::update(std::int32_t number, const AlignedBox& box) {
  boxes_[index_of(number)] = box;
}

// The axis with the largest variance of box centres; boxes without a finite centre are left out.
Eigen::Index BroadPhase::sweep_axis() const {
  Vector3 sum = Vector3::Zero();
  Vector3 sum_sq = Vector3::Zero();
  Scalar count = 0;
  for (const AlignedBox& box : boxes_) {
    const Vector3 center = box.center();
    if (!center.allFinite()) continue;
    sum += center;
    sum_sq += center.cwiseAbs2();
    ++count;
  }
  Eigen::Index axis = 0;
  const Vector3 variance = sum_sq - sum.cwiseAbs2() / std::max(count, 1.0);
  variance.maxCoeff(&axis);
  return axis;
}

// Insertion sort while the order is nearly right, as it is from step to step; a full sort when it
// is not.
void BroadPhase::sort_along(Eigen::Index axis) {
  const auto is_before = [&](std::int32_t x, std::int32_t y) {
    const Scalar low_x = boxes_[index_of(x)].min()[axis];
    const Scalar low_y = boxes_[index_of(y)].min()[axis];
    return low_x != low_y ? low_x < low_y : x < y;
  };
  std::size_t moves_left = 8 * order_.size();
  for (std::size_t i = 1; i < order_.size(); ++i) {
    for (std::size_t j = i; j > 0 && is_before(order_[j], order_[j - 1]); --j) {
      std::swap(order_[j], order_[j - 1]);
      if (--moves_left == 0) {
        std::sort(order_.begin(), order_.end(), is_before);
        return;
      }
    }
  }
}

std::vector<std::pair<std::int32_t, std::int32_t>> BroadPhase::find_pairs(
    const std::vector<bool>& may_move) {
  const Eigen::Index axis = sweep_axis();
  sort_along(axis);
  struct Entry {
    AlignedBox box;
    std::int32_t number;
    bool may_move;
  };
  std::vector<Entry> entries;  // side by side, in the order of the sweep
  entries.reserve(order_.size());
  for (const std::int32_t number : order_) {
    entries.push_back({boxes_[index_of(number)], number, may_move[index_of(number)]});
  }
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Entry& a = entries[i];
    const Scalar end = a.box.max()[axis];
    for (std::size_t k = i + 1; k < entries.size(); ++k) {
      const Entry& b = entries[k];
      if (b.box.min()[axis] > end) break;
      if ((a.may_move || b.may_move) && a.box.intersects(b.box)) {
        pairs.emplace_back(std::min(a.number, b.number), std::max(a.number, b.number));
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace dyop::internal
