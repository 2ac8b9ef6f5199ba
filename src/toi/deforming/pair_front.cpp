// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/pair_front.h"

#include <algorithm>

#include "core/tolerance.h"
#include "hierarchy/box_direction.h"

namespace dyop::internal {
namespace {

// Rounding of a key and of what is read from it, as a multiple of its size.
constexpr Scalar kKeyNoise = 8 * kUnitRoundoff;

// An opened pair is closed when it is proven to be so many of the latest motions beyond the reach:
// sooner, and it would be opened again soon. After so many it is tried again.
constexpr Scalar kLasting = 2;
constexpr Scalar kUntilTried = 16;

// How much of the pace one motion forgets.
constexpr Scalar kForgotten = 0.1;

// Enough for most pairs, so that no memory is asked for later.
constexpr std::size_t kReserved = 4096;
constexpr std::size_t kReservedMeasured = 2048;

bool are_leaves(const StandingPair& sides, std::int32_t a, std::int32_t b) {
  return sides.a.is_leaf(a) && sides.b.is_leaf(b);
}

// Of two boxes the larger one is opened.
bool is_first_opened(const StandingPair& sides, std::int32_t a, std::int32_t b) {
  const auto size = [](const OrientedBox& box) { return box.half_extents.squaredNorm(); };
  return !sides.a.is_leaf(a) &&
         (sides.b.is_leaf(b) || size(sides.a.box_W(a)) >= size(sides.b.box_W(b)));
}

}  // namespace

PairFront::PairFront(std::size_t most_nodes) : most_nodes_(most_nodes) {
  nodes_.reserve(kReserved);
  measured_.reserve(kReservedMeasured);
  restart();
}

void PairFront::restart() {
  moved_ = 0;
  size_ = 1;
  free_.fill(-1);
  measured_.clear();
  nodes_.resize(1);
  at(0) = {-kInfinity, Vector3::UnitX(), 0, 0, 0, -1, 0};
}

void PairFront::move(Scalar displacement) {
  // What was opened is closed only when it is examined again: after a long motion much of the tree
  // may be of no use.
  if (nodes_.size() > most_nodes_) restart();
  measured_.clear();
  moved_ = (moved_ + displacement) * (1 + 4 * kUnitRoundoff);
  pace_ = std::max(displacement, (1 - kForgotten) * pace_);
}

const PairFront::Measured* PairFront::measured(std::int32_t number) const {
  if (at(number).count > 0) return nullptr;
  const auto place = static_cast<std::size_t>(at(number).parts);
  if (place >= measured_.size() || measured_[place].node != number) return nullptr;
  return &measured_[place];
}

// --- the tree -------------------------------------------------------------------------------------

Scalar PairFront::key_of(Scalar gap) const {
  return gap + moved_ - kKeyNoise * (std::abs(gap) + moved_);
}

void PairFront::set_apart(std::int32_t number, Scalar gap, const Vector3& n_W) {
  if (at(number).count > 0) close(number);
  at(number).key = key_of(gap);
  at(number).n_W = n_W;
}

std::int32_t PairFront::take_block(int count) {
  size_ += static_cast<std::size_t>(count);
  std::int32_t& free = free_[static_cast<std::size_t>(count)];
  if (free >= 0) {
    const std::int32_t first = free;
    free = at(first).parts;
    return first;
  }
  const auto first = static_cast<std::int32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + static_cast<std::size_t>(count));
  return first;
}

// Gives the parts back, theirs first.
void PairFront::close(std::int32_t number) {
  const std::int32_t first = at(number).parts, count = at(number).count;
  for (std::int32_t part = first; part < first + count; ++part) {
    if (at(part).count > 0) close(part);
  }
  std::int32_t& free = free_[static_cast<std::size_t>(count)];
  at(first).parts = free;
  free = first;
  size_ -= static_cast<std::size_t>(count);
  at(number).parts = -1;
  at(number).count = 0;
}

// Replaces a pair of boxes by those of the larger one's parts with the other one. They keep its
// bound until they are examined.
void PairFront::open(const StandingPair& sides, std::int32_t number) {
  Node part = at(number);
  const bool opens_a = is_first_opened(sides, part.a, part.b);
  const std::int32_t opened = opens_a ? part.a : part.b;
  const int count = opens_a ? sides.a.part_count(opened) : sides.b.part_count(opened);
  const std::int32_t first = take_block(count);
  part.parts = -1;
  part.count = 0;
  for (int k = 0; k < count; ++k) {
    (opens_a ? part.a : part.b) = opens_a ? sides.a.part(opened, k) : sides.b.part(opened, k);
    at(first + k) = part;
  }
  at(number).parts = first;
  at(number).count = count;
}

// --- examination ----------------------------------------------------------------------------------

// What suffices for a pair that is not opened, and is worth closing an opened one for.
Scalar PairFront::far_enough(const Node& node, Scalar reach) const {
  return node.count == 0 ? reach : reach + kLasting * pace_;
}

PairFront::Finding PairFront::examine(const StandingPair& sides, std::int32_t number,
                                      Scalar reach) {
  ++examined_;
  const Node node = at(number);
  if (are_leaves(sides, node.a, node.b)) return examine_leaves(sides, number, reach);
  const Scalar wanted = far_enough(node, reach);
  const Scalar gap = sides.box_gap(node.a, node.b, node.n_W);
  if (gap > wanted) {
    set_apart(number, gap, node.n_W);
    return Finding::Apart;
  }
  const Vector3 n_W = separating_direction(sides.a.box_W(node.a), sides.b.box_W(node.b));
  const Scalar best_gap = sides.box_gap(node.a, node.b, n_W);
  if (best_gap > wanted) {
    set_apart(number, best_gap, n_W);
    return Finding::Apart;
  }
  at(number).n_W = n_W;
  if (node.count == 0) open(sides, number);
  at(number).try_after =
      moved_ + std::max(far_enough(at(number), reach) - best_gap, kUntilTried * pace_);
  return Finding::Opened;
}

PairFront::Finding PairFront::examine_leaves(const StandingPair& sides, std::int32_t number,
                                             Scalar reach) {
  const Node node = at(number);
  const Scalar gap = sides.triangle_gap(node.a, node.b, node.n_W);
  if (gap > reach) {
    set_apart(number, gap, node.n_W);
    return Finding::Apart;
  }
  const PieceDistance piece = leaf_distance(sides.a, node.a, sides.b, node.b, sides.noise);
  // Triangles that touch have no normal.
  set_apart(number, piece.lower, piece.lower > 0 ? piece.nhat_AB : node.n_W);
  if (piece.lower > reach) return Finding::Apart;
  at(number).parts = static_cast<std::int32_t>(measured_.size());
  measured_.push_back({piece, number});
  return Finding::Near;
}

// The pair that was nearest last time, measured again; or the nearest found in the time.
PieceDistance PairFront::first_nearest(const StandingPair& sides,
                                       const std::function<bool()>& is_over, BoxPairStack& stack) {
  if (sides.a.has_leaf(nearest_.a) && sides.b.has_leaf(nearest_.b)) {
    return leaf_distance(sides.a, nearest_.a, sides.b, nearest_.b, sides.noise);
  }
  DeformingTraversal<RigidSide> traversal(sides.a, sides.b, sides.noise, kInfinity, stack);
  traversal.start();
  while (!is_over() && !traversal.run_portion(1)) {
  }
  if (traversal.best.upper < kInfinity) nearest_ = {0, traversal.leaf_a, traversal.leaf_b};
  return traversal.best;
}

// Leaves below the pair of the front with the least bound, by way of the nearer parts.
BoxPair PairFront::promising_pair(const StandingPair& sides) const {
  const Node* node = &at(0);
  while (node->count > 0) {
    const Node* least = &at(node->parts);
    for (std::int32_t part = node->parts + 1; part < node->parts + node->count; ++part) {
      if (at(part).key < least->key) least = &at(part);
    }
    node = least;
  }
  BoxPair pair{0, node->a, node->b};
  while (!are_leaves(sides, pair.a, pair.b)) {
    const bool opens_a = is_first_opened(sides, pair.a, pair.b);
    const std::int32_t opened = opens_a ? pair.a : pair.b;
    const int count = opens_a ? sides.a.part_count(opened) : sides.b.part_count(opened);
    BoxPair nearest{kInfinity, pair.a, pair.b};
    for (int k = 0; k < count; ++k) {
      BoxPair part = pair;
      (opens_a ? part.a : part.b) = opens_a ? sides.a.part(opened, k) : sides.b.part(opened, k);
      const Vector3 n_W = separating_direction(sides.a.box_W(part.a), sides.b.box_W(part.b));
      part.gap = sides.box_gap(part.a, part.b, n_W);
      if (k == 0 || part.gap < nearest.gap) nearest = part;
    }
    pair = nearest;
  }
  return pair;
}

void PairFront::try_promising(const StandingPair& sides, PieceDistance& best) {
  const BoxPair pair = promising_pair(sides);
  const PieceDistance piece = leaf_distance(sides.a, pair.a, sides.b, pair.b, sides.noise);
  if (!(piece.upper < best.upper)) return;
  best = piece;
  nearest_ = {0, pair.a, pair.b};
}

}  // namespace dyop::internal
