// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/broad_phase.h"

#include <algorithm>
#include <cmath>

namespace dyop::dynamics_internal {
namespace {

// A slab holds about this many boxes, and is so many times wider than a box. Found by measurement.
constexpr std::size_t kBoxesPerSlab = 32;
constexpr Scalar kBoxesAcrossSlab = 4;

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

// Variance of box centres by axis, times their number; boxes without a finite centre are left out.
Vector3 BroadPhase::spread() const {
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
  return sum_sq - sum.cwiseAbs2() / std::max(count, 1.0);
}

std::size_t BroadPhase::Slabs::at(Scalar x) const {
  const Scalar place = (x - low) * per_length;
  if (!(place > 0)) return 0;
  return place < Scalar(count) ? static_cast<std::size_t>(place) : count - 1;
}

BroadPhase::Slabs BroadPhase::make_slabs(Eigen::Index axis) const {
  Scalar low = kInfinity;
  Scalar high = -kInfinity;
  Scalar extent = 0;
  Scalar count = 0;
  for (const AlignedBox& box : boxes_) {
    const Vector3 center = box.center();
    if (!center.allFinite()) continue;
    low = std::min(low, center[axis]);
    high = std::max(high, center[axis]);
    extent += box.sizes()[axis];
    ++count;
  }
  Slabs slabs{axis, low, 0, 1};
  const Scalar least = count > 0 ? kBoxesAcrossSlab * extent / count : 0;
  if (!(least > 0 && high - low > least)) return slabs;
  slabs.count = std::min(1 + boxes_.size() / kBoxesPerSlab,
                         static_cast<std::size_t>((high - low) / least) + 1);
  slabs.per_length = Scalar(slabs.count) / (high - low);
  return slabs;
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
  const Vector3 spreads = spread();
  Eigen::Index axis = 0;
  spreads.maxCoeff(&axis);
  const Eigen::Index u = (axis + 1) % 3;
  const Eigen::Index v = (axis + 2) % 3;
  sort_along(axis);
  const Slabs slabs = make_slabs(spreads[u] < spreads[v] ? v : u);
  const Eigen::Index across = slabs.axis;
  if (entries_.size() < slabs.count) entries_.resize(slabs.count);
  for (std::vector<Entry>& slab : entries_) slab.clear();
  for (const std::int32_t number : order_) {
    const AlignedBox& box = boxes_[index_of(number)];
    const std::size_t last = slabs.at(box.max()[across]);
    for (std::size_t s = slabs.at(box.min()[across]); s <= last; ++s) {
      entries_[s].push_back({box, number, may_move[index_of(number)]});
    }
  }
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (std::size_t s = 0; s < slabs.count; ++s) {
    const std::vector<Entry>& slab = entries_[s];
    for (std::size_t i = 0; i < slab.size(); ++i) {
      const Entry& a = slab[i];
      const Scalar end = a.box.max()[axis];
      for (std::size_t k = i + 1; k < slab.size(); ++k) {
        const Entry& b = slab[k];
        if (b.box.min()[axis] > end) break;
        if (!(a.may_move || b.may_move) || !a.box.intersects(b.box)) continue;
        // Boxes that share several slabs are a pair in the first of them.
        if (slabs.at(std::max(a.box.min()[across], b.box.min()[across])) != s) continue;
        pairs.emplace_back(std::min(a.number, b.number), std::max(a.number, b.number));
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace dyop::dynamics_internal
