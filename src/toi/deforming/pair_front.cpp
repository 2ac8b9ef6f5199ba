// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/pair_front.h"

#include <algorithm>
#include <limits>

#include "core/tolerance.h"
#include "hierarchy/box_direction.h"

namespace dyop::internal {
namespace {

// Rounding of a key and of what is read from it, as a multiple of its size.
constexpr Scalar kKeyNoise = 8 * kUnitRoundoff;

// About 12 MB. Fronts only grow until they are renewed, which ticks that are cut off never do.
constexpr std::size_t kMostEntries = std::size_t{1} << 18;

// Enough for most pairs, so that no memory is asked for later.
constexpr std::size_t kReserved = 4096;
constexpr std::size_t kReservedMeasured = 256;

bool are_leaves(const StandingPair& sides, std::int32_t a, std::int32_t b) {
  return sides.a.is_leaf(a) && sides.b.is_leaf(b);
}

// A bound of the distance of two boxes: their gap along n.
Scalar gap_of_boxes(const StandingPair& sides, std::int32_t a, std::int32_t b, const Vector3& n_W) {
  return -sides.b.box_reach(b, -n_W) - sides.a.box_support(a, n_W).at(0, 0) - sides.noise;
}

Scalar gap_of_triangles(const StandingPair& sides, std::int32_t a, std::int32_t b,
                        const Vector3& n_W) {
  return -sides.b.triangle_reach(b, -n_W) - largest_along(sides.a.triangle_W(a), n_W) - sides.noise;
}

}  // namespace

PairFront::PairFront() {
  entries_.reserve(kReserved);
  heap_.reserve(kReserved);
  measured_.reserve(kReservedMeasured);
  restart();
}

void PairFront::restart() {
  moved_ = 0;
  measured_.clear();
  entries_.assign(1, {0, 0, Vector3::UnitX()});
  heap_.assign(1, {-kInfinity, 0});
}

void PairFront::move(Scalar displacement) {
  if (entries_.size() > kMostEntries) restart();
  for (const Measured& known : measured_) add(known.place);
  measured_.clear();
  moved_ = (moved_ + displacement) * (1 + 4 * kUnitRoundoff);
}

Scalar PairFront::lower() const {
  Scalar least = heap_.empty() ? kInfinity : heap_.front().key - moved_;
  for (const Measured& known : measured_) least = std::min(least, known.piece.lower);
  return least;
}

// --- the heap -------------------------------------------------------------------------------------

Scalar PairFront::key_of(Scalar gap) const {
  return gap + moved_ - kKeyNoise * (std::abs(gap) + moved_);
}

void PairFront::add(const Place& place) {
  std::size_t at = heap_.size();
  heap_.push_back(place);
  for (; at > 0; at = (at - 1) / 2) {
    const Place above = heap_[(at - 1) / 2];
    if (above.key <= place.key) break;
    heap_[at] = above;
  }
  heap_[at] = place;
}

void PairFront::sink_top() {
  const Place top = heap_.front();
  const std::size_t count = heap_.size();
  std::size_t at = 0;
  for (std::size_t below = 1; below < count; below = 2 * at + 1) {
    if (below + 1 < count && heap_[below + 1].key < heap_[below].key) ++below;
    if (!(heap_[below].key < top.key)) break;
    heap_[at] = heap_[below];
    at = below;
  }
  heap_[at] = top;
}

void PairFront::keep_top(Scalar gap, const Vector3& n_W) {
  top().n_W = n_W;
  heap_.front().key = key_of(gap);
  sink_top();
}

// --- examination ----------------------------------------------------------------------------------

PairFront::Finding PairFront::examine(const StandingPair& sides, Scalar reach) {
  const Entry entry = top();
  if (are_leaves(sides, entry.a, entry.b)) return examine_leaves(sides, reach);
  const Scalar gap = gap_of_boxes(sides, entry.a, entry.b, entry.n_W);
  if (gap > reach) {
    keep_top(gap, entry.n_W);
    return Finding::Apart;
  }
  const Vector3 n_W = separating_direction(sides.a.box_W(entry.a), sides.b.box_W(entry.b));
  const Scalar best_gap = gap_of_boxes(sides, entry.a, entry.b, n_W);
  if (best_gap > reach) {
    keep_top(best_gap, n_W);
    return Finding::Apart;
  }
  top().n_W = n_W;
  open(sides);
  return Finding::Opened;
}

PairFront::Finding PairFront::examine_leaves(const StandingPair& sides, Scalar reach) {
  const Entry entry = top();
  const Scalar gap = gap_of_triangles(sides, entry.a, entry.b, entry.n_W);
  if (gap > reach) {
    keep_top(gap, entry.n_W);
    return Finding::Apart;
  }
  const PieceDistance piece = leaf_distance(sides.a, entry.a, sides.b, entry.b, sides.noise);
  // Triangles that touch have no normal.
  const Vector3 n_W = piece.lower > 0 ? piece.nhat_AB : entry.n_W;
  if (piece.lower > reach) {
    keep_top(piece.lower, n_W);
    return Finding::Apart;
  }
  top().n_W = n_W;
  measured_.push_back({piece, {key_of(piece.lower), heap_.front().entry}});
  heap_.front() = heap_.back();
  heap_.pop_back();
  if (!heap_.empty()) sink_top();
  return Finding::Near;
}

// Replaces a pair of boxes by those of the larger one's parts with the other one. They keep its
// bound until they are examined.
void PairFront::open(const StandingPair& sides) {
  const Entry entry = top();
  const Scalar key = heap_.front().key;
  const auto size = [](const OrientedBox& box) { return box.half_extents.squaredNorm(); };
  const bool opens_a =
      !sides.a.is_leaf(entry.a) &&
      (sides.b.is_leaf(entry.b) || size(sides.a.box_W(entry.a)) >= size(sides.b.box_W(entry.b)));
  const int count = opens_a ? sides.a.part_count(entry.a) : sides.b.part_count(entry.b);
  for (int k = 0; k < count; ++k) {
    Entry part = entry;
    (opens_a ? part.a : part.b) = opens_a ? sides.a.part(entry.a, k) : sides.b.part(entry.b, k);
    if (k == 0) {
      top() = part;
      continue;
    }
    entries_.push_back(part);
    add({key, std::uint32_t(entries_.size() - 1)});
  }
}

// The pair that was nearest last time, measured again.
PieceDistance PairFront::first_nearest(const StandingPair& sides, BoxPairStack& stack) {
  if (sides.a.has_leaf(nearest_.a) && sides.b.has_leaf(nearest_.b)) {
    return leaf_distance(sides.a, nearest_.a, sides.b, nearest_.b, sides.noise);
  }
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, kInfinity, stack);
  traversal.start();
  traversal.run_portion(std::numeric_limits<std::int64_t>::max());
  nearest_ = {0, traversal.leaf_a, traversal.leaf_b};
  return traversal.best;
}

}  // namespace dyop::internal
