// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/pair_front.h"

#include <algorithm>

#include "core/tolerance.h"
#include "hierarchy/split_tree.h"

namespace dyop::toi_internal {
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

// Whether all vertices of a feature are corners of a leaf's triangle.
template <typename Side>
bool has_feature(const Side& side, std::int32_t leaf, const Feature& feature) {
  const TriangleIndices& corners = side.triangles()[static_cast<std::size_t>(side.triangle(leaf))];
  const auto end = feature.vertices.begin() + static_cast<std::ptrdiff_t>(feature.vertex_count());
  return std::all_of(feature.vertices.begin(), end, [&](std::int32_t vertex) {
    return std::find(corners.begin(), corners.end(), vertex) != corners.end();
  });
}

// The larger of two boxes is opened.
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
  shift_W_.setZero();
  rest_ = 0;
  sought_ = kInfinity;
  at(0) = {-kInfinity, Vector3::UnitX(), -kInfinity, 0, 0, 0, -1, 0};
}

void PairFront::move(const Displacement& displacement) {
  // What was opened is closed only when it is examined again: after a long motion much of the tree
  // may be of no use.
  if (nodes_.size() > most_nodes_) restart();
  measured_.clear();
  constexpr Scalar kRounding = 4 * kUnitRoundoff;
  moved_ = (moved_ + displacement.largest) * (1 + kRounding);
  pace_ = std::max(displacement.largest, (1 - kForgotten) * pace_);
  shift_W_ += displacement.shift_W;
  rest_ = (rest_ + displacement.rest) * (1 + kRounding) + kRounding * shift_W_.lpNorm<1>();
}

const PairFront::Measured* PairFront::measured(std::int32_t number) const {
  if (at(number).count > 0) return nullptr;
  const auto place = static_cast<std::size_t>(at(number).parts);
  if (place >= measured_.size() || measured_[place].node != number) return nullptr;
  return &measured_[place];
}

// --- the tree -----------------------------------------------------------------------------------

Scalar PairFront::key_of(Scalar gap) const {
  return gap + moved_ - kKeyNoise * (std::abs(gap) + moved_);
}

void PairFront::set_apart(std::int32_t number, Scalar gap, const Vector3& n_W) {
  if (at(number).count > 0) close(number);
  at(number).key = key_of(gap);
  set_along(number, gap, n_W);
}

// A pair that is not opened: its gap along n is this now.
void PairFront::set_along(std::int32_t number, Scalar gap, const Vector3& n_W) {
  at(number).n_W = n_W;
  at(number).along = gap - n_W.dot(shift_W_) + rest_;
}

// The same gap after all motions since then.
Scalar PairFront::gap_along(const Node& node) const {
  const Scalar size = std::abs(node.along) + shift_W_.lpNorm<1>() + rest_;
  return node.along + node.n_W.dot(shift_W_) - rest_ - kKeyNoise * size;
}

// Whether what is left of the gap is enough, without another look at the places.
bool PairFront::is_still_apart(const Question& question, std::int32_t number) {
  const Node& node = at(number);
  if (node.count > 0) return false;
  const Scalar gap = gap_along(node);
  if (!is_enough(question, gap, node, node.n_W)) return false;
  at(number).key = std::max(node.key, key_of(gap));
  return true;
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

// --- examination --------------------------------------------------------------------------------

// What is worth closing an opened pair for.
Scalar PairFront::closing_gap(Scalar reach) const {
  return reach + kLasting * pace_;
}

// Whether a gap along n answers the question. Compares keys as descend() does, so that rounding
// does not put a pair on both sides.
bool PairFront::is_enough(const Question& question, Scalar gap, const Node& node,
                          const Vector3& n_W) const {
  const auto& [sides, reach, approach] = question;
  const bool is_beyond = key_of(gap) > reach + moved_;
  if (!approach || is_beyond) return is_beyond;
  // Fast reject: most pairs fail by a wide margin.
  return gap > approach->least + approach->slack &&
         (gap > approach->needed_gap(n_W) ||
          gap > approach->needed_gap(n_W, sides.b.box_W(node.b)));
}

PairFront::Finding PairFront::examine(const Question& question, std::int32_t number) {
  const auto& sides = question.sides;
  const auto& reach = question.reach;
  ++examined_;
  const Node node = at(number);
  if (are_leaves(sides, node.a, node.b)) return examine_leaves(question, number);
  // An opened pair is closed only for what is far in all directions.
  const auto is_far = [&](Scalar gap, const Vector3& n_W) {
    return node.count == 0 ? is_enough(question, gap, node, n_W) : gap > closing_gap(reach);
  };
  Scalar best_gap = -kInfinity;
  Vector3 best_n_W = node.n_W;
  const auto is_apart_along = [&](const Vector3& n_W) {
    const Scalar gap = sides.box_gap(node.a, node.b, n_W);
    const bool is_apart = is_far(gap, n_W);
    if (is_apart || gap > best_gap) {
      best_gap = gap;
      best_n_W = n_W;
    }
    return is_apart;
  };
  // The cheap directions first.
  if (is_apart_along(node.n_W) || is_apart_along(nearest_n_W_) ||
      (sides.slabs && is_apart_along(sides.slab_direction(node.a, node.b))) ||
      is_apart_along(separating_direction(sides.a.box_W(node.a), sides.b.box_W(node.b)))) {
    set_apart(number, best_gap, best_n_W);
    return Finding::Apart;
  }
  set_along(number, best_gap, best_n_W);
  if (node.count == 0) open(sides, number);
  at(number).try_after = moved_ + std::max(closing_gap(reach) - best_gap, kUntilTried * pace_);
  return Finding::Opened;
}

PairFront::Finding PairFront::examine_leaves(const Question& question, std::int32_t number) {
  const StandingPair& sides = question.sides;
  const Node node = at(number);
  const Scalar gap = sides.triangle_gap(node.a, node.b, node.n_W);
  if (is_enough(question, gap, node, node.n_W)) {
    set_apart(number, gap, node.n_W);
    return Finding::Apart;
  }
  const std::optional<PieceDistance> shared = shared_nearest(sides, node);
  const PieceDistance piece =
      shared ? *shared : leaf_distance(sides.a, node.a, sides.b, node.b, sides.noise);
  set_apart(number, piece.lower, node.n_W);
  // Triangles that touch have no normal.
  const Vector3 n_W = piece.lower > 0 ? piece.nhat_AB : node.n_W;
  set_along(number, sides.triangle_gap(node.a, node.b, n_W), n_W);
  if (is_enough(question, piece.lower, node, at(number).n_W)) return Finding::Apart;
  at(number).parts = static_cast<std::int32_t>(measured_.size());
  if (!shared) last_measured_ = measured_.size();
  measured_.push_back({piece, number});
  return Finding::Near;
}

// Triangles that share the vertices or edges where the last two measured were nearest are no
// farther apart than these, and are nearest in the same points if their gap along the same normal
// is not less. So the many triangles around two vertices are not measured one by one.
std::optional<PieceDistance> PairFront::shared_nearest(const StandingPair& sides,
                                                       const Node& node) const {
  if (last_measured_ >= measured_.size()) return std::nullopt;
  const PieceDistance& last = measured_[last_measured_].piece;
  if (!(last.lower > 0) || !has_feature(sides.a, node.a, last.feature_a) ||
      !has_feature(sides.b, node.b, last.feature_b)) {
    return std::nullopt;
  }
  const Scalar gap = sides.triangle_gap(node.a, node.b, last.nhat_AB);
  if (!(gap >= last.lower - sides.noise)) return std::nullopt;
  PieceDistance shared = last;
  shared.lower = std::min(gap, last.lower);
  return shared;
}

std::optional<PieceDistance> PairFront::measure_again(const StandingPair& sides) const {
  if (!sides.a.has_leaf(nearest_.a) || !sides.b.has_leaf(nearest_.b)) return std::nullopt;
  return leaf_distance(sides.a, nearest_.a, sides.b, nearest_.b, sides.noise);
}

// The pair that was nearest last time, measured again; or the nearest found in the time.
PieceDistance PairFront::first_nearest(const StandingPair& sides,
                                       const std::function<bool()>& is_over, BoxPairStack& stack) {
  if (const auto again = measure_again(sides)) return *again;
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

}  // namespace dyop::toi_internal
