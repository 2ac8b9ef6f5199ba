// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/hierarchy/mesh_hierarchy.h"
#include "toi/deforming/deforming_traversal.h"
#include "toi/deforming/expected_approach.h"
#include "toi/deforming/standing_pair.h"

namespace dyop::toi_internal {

/// An array that grows by whole blocks: elements never move, so that growing costs the same however
/// many there are. Memory is kept until the end.
template <typename Element>
class GrowingBlocks {
 public:
  std::size_t size() const { return size_; }
  /// New elements have no value yet.
  void resize(std::size_t size) {
    reserve(size);
    size_ = size;
  }
  void reserve(std::size_t size) {
    while (blocks_.size() * kBlock < size) {
      blocks_.push_back(std::make_unique_for_overwrite<Element[]>(kBlock));
    }
  }

  Element& operator[](std::size_t number) { return blocks_[number / kBlock][number % kBlock]; }
  const Element& operator[](std::size_t number) const {
    return blocks_[number / kBlock][number % kBlock];
  }

 private:
  static constexpr std::size_t kBlock = 1024;

  std::vector<std::unique_ptr<Element[]>> blocks_;
  std::size_t size_ = 0;
};

/// What is known of the distance of a deforming mesh A from a rigid mesh B, kept while both move: a
/// tree of pairs of their boxes, opened as far as was needed. Every pair of triangles is below
/// exactly one pair that is not opened; these are the front. Each carries a direction n and the gap
/// b along it when it was examined. If no point has moved by more than m since, relative to any
/// point of the other side, the distance of all its triangles is at least b - m; if all of B has
/// moved by D and nothing by more than T besides, also b + n.D - T. So a query soon after the last
/// one examines only the pairs whose bounds no longer suffice, and opened pairs that have become far
/// enough are closed (docs/haptics.md).
///
/// The meshes and the numbers of their vertices must stay the same, or restart() and seed() be
/// called; places may change.
class DYOP_EXPORT PairFront {
 public:
  /// About 4 MB: half as much again as an instrument needs near an organ.
  static constexpr std::size_t kMostNodes = std::size_t{1} << 16;

  /// @param most_nodes A tree larger than three quarters of this keeps no pairs opened that are
  ///                   farther apart than a question's reach.
  explicit PairFront(std::size_t most_nodes = kMostNodes);

  /// Forgets everything but the nearest pair.
  void restart();
  /// No point of A has moved relative to any point of B by more than `displacement`, >= 0, since
  /// the last call, rounding included. A tree that has grown too large is restarted.
  void move(Scalar displacement) { move({displacement, Vector3::Zero(), displacement}); }
  /// The same, told apart: all of B has moved by the shift, and no point of A relative to any of B
  /// by more than the rest besides.
  struct Displacement {
    Scalar largest;
    Vector3 shift_W;
    Scalar rest;
  };
  void move(const Displacement& displacement);
  /// Lower bound of the distance of all triangles; -infinity if nothing is known.
  Scalar lower() const { return at(0).key - moved_; }
  /// Pairs in the tree, the opened ones too.
  std::size_t size() const { return size_; }

  /// Examines pairs until each is proven farther apart than `reach` or is a pair of triangles
  /// measured at the present places. Those not proven farther apart are handed to
  /// visit(piece, leaf of A, leaf of B), which returns the reach from then on, at most the last.
  /// @param is_over Called before every examination and every visit, and for some of the pairs that
  ///                need neither; if it says yes, the call ends. What was found is kept.
  /// @return Whether it went through.
  template <typename IsOver, typename Visit>
  bool refine(const StandingPair& sides, Scalar reach, const IsOver& is_over, const Visit& visit);
  /// The same for the pairs that matter for an expected motion: of those not visited, every one is
  /// proven farther apart along some direction than needed_gap() says.
  template <typename IsOver, typename Visit>
  bool refine(const StandingPair& sides, const ExpectedApproach& approach, const IsOver& is_over,
              const Visit& visit);

  /// Calls visit(a, b, n) for every pair of the front, opened no further, whose lower bound is more
  /// than `near`, which refine() has seen to, but not more than `far`; n is the unit direction
  /// along which it was last proven apart.
  /// @param is_over As above, before every visit.
  template <typename IsOver, typename Visit>
  bool for_each_between(Scalar near, Scalar far, const IsOver& is_over, const Visit& visit) const {
    return descend_between(near + moved_, far + moved_, is_over, visit, 0);
  }

  /// How well a distance is to be known: lower() at most `allowed` below it, or below `farthest`;
  /// if that takes a search, at most `tight`, so that it lasts a while.
  struct NearestGoal {
    Scalar farthest;
    Scalar allowed;
    Scalar tight;
  };
  /// Searches for the nearest pair until the goal is reached. A search that is ended by is_over()
  /// is gone on with by the next call, wherever the meshes are then: what it has already proven far
  /// enough for the goal it began with is not examined again.
  /// @param best Replaced by a pair of triangles and its distance; its upper bound always holds.
  /// @return Whether it went through.
  template <typename IsOver>
  bool find_nearest(const StandingPair& sides, const NearestGoal& goal, const IsOver& is_over,
                    BoxPairStack& stack, PieceDistance& best);
  /// The pair that find_nearest() found, or was given, measured where it is now; nothing if there
  /// is none.
  std::optional<PieceDistance> measure_again(const StandingPair& sides) const;
  /// Where find_nearest() starts; negative: nowhere.
  void seed(const BoxPair& nearest) { nearest_ = nearest; }
  /// The leaves of the pair that find_nearest() found.
  const BoxPair& nearest() const { return nearest_; }

 private:
  enum class Finding { Apart, Near, Opened };
  // Blocks of parts that are not in use are linked by `parts` of their first node.
  static constexpr int kMostParts = BoxGroup::kWidth;
  // It is asked whether a call is over for this many pairs that need no examination, too.
  static constexpr std::size_t kVisitsAsked = 32;
  // A search of so many pairs was worth looking for a nearer one first.
  static constexpr std::size_t kLongSearch = 100;

  // A line of the cache: a tick passes thousands of them.
  struct alignas(64) Node {
    // The lower bound of the distance when it was examined, plus all displacements until then; of
    // an opened pair the least of its parts, or less.
    Scalar key;
    Vector3 n_W;       // unit, along which the two were last proven apart
    Scalar along;      // not opened: the gap along n then, minus n.shift_, plus rest_
    Scalar try_after;  // opened: sum of displacements before which it is not examined
    std::int32_t a;
    std::int32_t b;
    std::int32_t parts;  // opened: its first part; leaves: where it may have been measured
    std::int32_t count;  // of parts; 0: not opened
  };
  // A pair of triangles measured at the present places.
  struct Measured {
    PieceDistance piece;
    std::int32_t node;
  };
  template <typename IsOver, typename Visit>
  struct Pass {
    const StandingPair& sides;
    Scalar reach;
    const ExpectedApproach* approach;  // null: whatever the direction
    const IsOver& is_over;
    const Visit& visit;
  };

  template <typename IsOver>
  bool search(const StandingPair& sides, const NearestGoal& goal, const IsOver& is_over,
              PieceDistance& best);
  template <typename IsOver, typename Visit>
  bool descend(Pass<IsOver, Visit>& pass, std::int32_t number);
  template <typename IsOver, typename Visit>
  bool descend_to_parts(Pass<IsOver, Visit>& pass, std::int32_t number);
  void fetch_parts(std::int32_t first, std::int32_t end, Scalar key) const;
  template <typename IsOver, typename Visit>
  bool descend_between(Scalar near_key, Scalar far_key, const IsOver& is_over, const Visit& visit,
                       std::int32_t number) const;
  struct Question {
    const StandingPair& sides;
    Scalar reach;
    const ExpectedApproach* approach;
  };
  bool is_enough(const Question& question, Scalar gap, const Node& node, const Vector3& n_W) const;
  bool is_still_apart(const Question& question, std::int32_t number);
  Finding examine(const Question& question, std::int32_t number);
  Finding examine_leaves(const Question& question, std::int32_t number);
  std::optional<PieceDistance> shared_nearest(const StandingPair& sides, const Node& node) const;
  const Measured* measured(std::int32_t number) const;
  Scalar closing_gap(Scalar reach) const;
  void open(const StandingPair& sides, std::int32_t number);
  void close(std::int32_t number);
  bool is_crowded() const { return size_ > most_nodes_ / 4 * 3; }
  std::int32_t take_block(int count);
  void set_apart(std::int32_t number, Scalar gap, const Vector3& n_W);
  void set_along(std::int32_t number, Scalar gap, const Vector3& n_W);
  Scalar gap_along(const Node& node) const;
  Scalar key_of(Scalar gap) const;
  BoxPair promising_pair(const StandingPair& sides) const;
  void try_promising(const StandingPair& sides, PieceDistance& best);
  PieceDistance first_nearest(const StandingPair& sides, const std::function<bool()>& is_over,
                              BoxPairStack& stack);

  Node& at(std::int32_t number) { return nodes_[static_cast<std::size_t>(number)]; }
  const Node& at(std::int32_t number) const { return nodes_[static_cast<std::size_t>(number)]; }

  std::size_t most_nodes_;
  GrowingBlocks<Node> nodes_;                        // the first is the root
  std::array<std::int32_t, kMostParts + 1> free_{};  // by the number of nodes; -1: none
  std::size_t size_ = 0;
  std::vector<Measured> measured_;
  std::size_t last_measured_ = 0;      // the last one not taken over from another
  Scalar moved_ = 0;                   // sum of all displacements
  Scalar pace_ = 0;                    // of late, in one motion
  Vector3 shift_W_ = Vector3::Zero();  // sum of all shifts
  Scalar rest_ = 0;                    // sum of all rests, rounding of the shifts included
  BoxPair nearest_{0, -1, -1};
  Vector3 nearest_n_W_ = Vector3::UnitX();  // unit, between its points when last measured
  Scalar sought_ = kInfinity;    // the key that an unfinished search raises all others to; or none
  std::size_t examined_ = 0;     // in all
  std::size_t visited_ = 0;      // examined or not
  std::size_t last_search_ = 0;  // of them by find_nearest()
};

// The members of PairFront that are templates.

template <typename IsOver, typename Visit>
bool PairFront::refine(const StandingPair& sides, Scalar reach, const IsOver& is_over,
                       const Visit& visit) {
  Pass<IsOver, Visit> pass{sides, reach, nullptr, is_over, visit};
  return descend(pass, 0);
}

template <typename IsOver, typename Visit>
bool PairFront::refine(const StandingPair& sides, const ExpectedApproach& approach,
                       const IsOver& is_over, const Visit& visit) {
  const auto visit_all = [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
    visit(piece, a, b);
    return approach.reach;
  };
  Pass<IsOver, decltype(visit_all)> pass{sides, approach.reach, &approach, is_over, visit_all};
  return descend(pass, 0);
}

template <typename IsOver, typename Visit>
bool PairFront::descend(Pass<IsOver, Visit>& pass, std::int32_t number) {
  const Node& node = at(number);
  if (node.key > pass.reach + moved_) return true;
  if (++visited_ % kVisitsAsked == 0 && pass.is_over()) return false;
  if (node.count > 0 && node.try_after > moved_) return descend_to_parts(pass, number);
  const Question question{pass.sides, pass.reach, pass.approach};
  const Measured* near = measured(number);
  if (!near && is_still_apart(question, number)) return true;
  if (pass.is_over()) return false;
  if (!near) {
    const Finding finding = examine(question, number);
    if (finding == Finding::Apart) return true;
    if (finding == Finding::Opened) return descend_to_parts(pass, number);
    near = &measured_.back();
  }
  pass.reach = pass.visit(near->piece, at(number).a, at(number).b);
  return true;
}

template <typename IsOver, typename Visit>
bool PairFront::descend_between(Scalar near_key, Scalar far_key, const IsOver& is_over,
                                const Visit& visit, std::int32_t number) const {
  const Node& node = at(number);
  if (node.key > far_key) return true;
  if (node.count == 0) {
    if (!(node.key > near_key)) return true;
    if (is_over()) return false;
    visit(node.a, node.b, node.n_W);
    return true;
  }
  for (std::int32_t part = node.parts; part < node.parts + node.count; ++part) {
    if (!descend_between(near_key, far_key, is_over, visit, part)) return false;
  }
  return true;
}

// What the parts up to this key are made of comes into the cache meanwhile, all at once: after a
// snapshot was refitted nothing of it is there.
inline void PairFront::fetch_parts(std::int32_t first, std::int32_t end, Scalar key) const {
  for (std::int32_t part = first; part < end; ++part) {
    const Node& node = at(part);
    if (node.count > 0 && !(node.key > key)) __builtin_prefetch(&at(node.parts));
  }
}

// Opening a part may move all nodes.
template <typename IsOver, typename Visit>
bool PairFront::descend_to_parts(Pass<IsOver, Visit>& pass, std::int32_t number) {
  const std::int32_t first = at(number).parts, end = first + at(number).count;
  bool is_through = true;
  Scalar least = kInfinity;
  fetch_parts(first, end, pass.reach + moved_);
  for (std::int32_t part = first; part < end; ++part) {
    if (is_through) is_through = descend(pass, part);
    least = std::min(least, at(part).key);
  }
  at(number).key = least;
  // The least bound says enough of parts that are all apart.
  if (is_through && least > pass.reach + moved_ && is_crowded()) close(number);
  return is_through;
}

template <typename IsOver>
bool PairFront::find_nearest(const StandingPair& sides, const NearestGoal& goal,
                             const IsOver& is_over, BoxPairStack& stack, PieceDistance& best) {
  best = first_nearest(sides, std::cref(is_over), stack);
  if (best.lower > 0) nearest_n_W_ = best.nhat_AB;
  const auto is_reached = [&] {
    return lower() >= std::min(best.upper, goal.farthest) - goal.allowed;
  };
  if (is_reached()) {
    last_search_ = 0;
    return true;
  }
  // An older search may end with less than is wanted now.
  return search(sides, goal, is_over, best) && (is_reached() || search(sides, goal, is_over, best));
}

template <typename IsOver>
bool PairFront::search(const StandingPair& sides, const NearestGoal& goal, const IsOver& is_over,
                       PieceDistance& best) {
  const auto reach = [&] {
    return std::min(std::min(best.upper, goal.farthest) - goal.tight, sought_ - moved_);
  };
  // A distance that is a little too large has all pairs examined that the true one leaves out.
  const bool was_long = last_search_ > kLongSearch;
  if (was_long && lower() < reach() && !is_over()) try_promising(sides, best);
  const std::size_t before = examined_;
  sought_ = reach() + moved_;
  const bool is_through = refine(sides, reach(), is_over,
                                 [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
                                   if (piece.upper < best.upper) {
                                     best = piece;
                                     nearest_ = {0, a, b};
                                   }
                                   return reach();
                                 });
  last_search_ = examined_ - before;
  if (is_through) sought_ = kInfinity;
  return is_through;
}

}  // namespace dyop::toi_internal
