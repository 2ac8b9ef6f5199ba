// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "dyop/core/export.h"
#include "toi/deforming/deforming_traversal.h"
#include "toi/deforming/standing_pair.h"

namespace dyop::internal {

/// What is known of the distance of a deforming mesh A from a rigid mesh B, kept while both move: a
/// front through the tree of pairs of their boxes. Every pair of triangles is below exactly one of
/// its entries. Each entry carries a lower bound of the distance of all its triangles; what the two
/// have moved since is subtracted. So a query soon after the last one examines only the entries
/// whose bounds no longer suffice (docs/algorithms/tool_loop.md, "The front").
///
/// The meshes and the numbers of their vertices must stay the same; places may change.
class DYOP_EXPORT PairFront {
 public:
  PairFront();

  /// Forgets everything but the nearest pair.
  void restart();
  /// No point of A has moved relative to any point of B by more than `displacement`, >= 0, since
  /// the last call, rounding included. A front that has grown too large is restarted.
  void move(Scalar displacement);
  /// Lower bound of the distance of all triangles; -infinity if nothing is known.
  Scalar lower() const;
  std::size_t size() const { return entries_.size(); }

  /// Examines entries until each is proven farther apart than `reach` or is a pair of triangles
  /// measured at the present places. Those not proven farther apart are handed to
  /// visit(piece, leaf of A, leaf of B), which returns the reach from then on, at most the last.
  /// @param is_over Called before every examination; if it says yes, the call ends. What was found
  ///                is kept.
  /// @return Whether it went through.
  template <typename IsOver, typename Visit>
  bool refine(const StandingPair& sides, Scalar reach, const IsOver& is_over, const Visit& visit);

  /// Searches for the nearest pair until lower() is at most `allowed` below its distance, or below
  /// `farthest`.
  /// @param best Replaced by a pair of triangles and its distance; its upper bound always holds.
  /// @return Whether it went through.
  template <typename IsOver>
  bool find_nearest(const StandingPair& sides, Scalar farthest, Scalar allowed,
                    const IsOver& is_over, BoxPairStack& stack, PieceDistance& best);
  /// Where find_nearest() starts.
  void seed(const BoxPair& nearest) { nearest_ = nearest; }
  /// The leaves of the pair that find_nearest() found.
  const BoxPair& nearest() const { return nearest_; }

 private:
  enum class Finding { Apart, Near, Opened };
  struct Entry {
    std::int32_t a;
    std::int32_t b;
    Vector3 n_W;  // unit, along which the two were last proven apart
  };
  // In a heap, the least key on top: the lower bound of an entry's distance when it was examined,
  // plus all displacements until then.
  struct Place {
    Scalar key;
    std::uint32_t entry;
  };
  // A pair of triangles measured at the present places: out of the heap until the next motion.
  struct Measured {
    PieceDistance piece;
    Place place;
  };

  Finding examine(const StandingPair& sides, Scalar reach);
  Finding examine_leaves(const StandingPair& sides, Scalar reach);
  void open(const StandingPair& sides);
  void keep_top(Scalar gap, const Vector3& n_W);
  void add(const Place& place);
  void sink_top();
  Scalar key_of(Scalar gap) const;
  PieceDistance first_nearest(const StandingPair& sides, BoxPairStack& stack);

  Entry& top() { return entries_[heap_.front().entry]; }

  std::vector<Entry> entries_;
  std::vector<Place> heap_;
  std::vector<Measured> measured_;
  Scalar moved_ = 0;  // sum of all displacements
  BoxPair nearest_{0, -1, -1};
};

template <typename IsOver, typename Visit>
bool PairFront::refine(const StandingPair& sides, Scalar reach, const IsOver& is_over,
                       const Visit& visit) {
  const auto show = [&](const Measured& near) {
    const Entry& entry = entries_[near.place.entry];
    reach = visit(near.piece, entry.a, entry.b);
  };
  for (const Measured& known : measured_) {
    if (!(known.piece.lower > reach)) show(known);
  }
  while (!heap_.empty() && !(heap_.front().key > reach + moved_)) {
    if (is_over()) return false;
    if (examine(sides, reach) == Finding::Near) show(measured_.back());
  }
  return true;
}

template <typename IsOver>
bool PairFront::find_nearest(const StandingPair& sides, Scalar farthest, Scalar allowed,
                             const IsOver& is_over, BoxPairStack& stack, PieceDistance& best) {
  best = first_nearest(sides, stack);
  const auto reach = [&] { return std::min(best.upper, farthest) - allowed; };
  return refine(sides, reach(), is_over,
                [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
                  if (piece.upper < best.upper) {
                    best = piece;
                    nearest_ = {0, a, b};
                  }
                  return reach();
                });
}

}  // namespace dyop::internal
