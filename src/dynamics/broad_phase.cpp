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
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  struct Open {  // a box that the sweep has entered and not left
    AlignedBox box;
    std::int32_t number;
    bool may_move;
  };
  std::vector<Open> open;
  for (const std::int32_t number : order_) {
    const AlignedBox& box = boxes_[index_of(number)];
    const bool moves = may_move[index_of(number)];
    const Scalar low = box.min()[axis];
    std::erase_if(open, [&](const Open& other) { return other.box.max()[axis] < low; });
    for (const Open& other : open) {
      if ((moves || other.may_move) && box.intersects(other.box)) {
        pairs.emplace_back(std::min(number, other.number), std::max(number, other.number));
      }
    }
    open.push_back({box, number, moves});
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace dyop::internal
