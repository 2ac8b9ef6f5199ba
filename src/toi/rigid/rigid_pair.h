// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "distance/distance_traversal.h"
#include "dyop/core/export.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/impact_band.h"
#include "toi/radix_queue.h"
#include "toi/rigid/moving_pair.h"

namespace dyop::toi_internal {

/// Two rigid sides, for BestFirstSearch. The frame of pieces is A's.
class RigidPair {
 public:
  RigidPair(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
            const TimeInterval& interval, const ImpactBand& band,
            std::span<const BoxPair> first_pairs = {&kRootPair, 1});

  void set_time(Scalar t) { moving_.set_time(t); }
  Scalar time() const { return moving_.time(); }
  Scalar noise() const { return moving_.noise(); }
  /// The noise of the poses at the current time, whatever the speeds.
  Scalar start_noise() const;

  /// A proven time, or infinity; leaves the sides at a time that is not later.
  Scalar first_time();
  std::span<const BoxPair> first_pairs() const { return first_pairs_; }
  /// A point inside both shapes at the current time, if the options declare one of them a solid.
  std::optional<Vector3> enclosed_point(const ToiOptions& options) const;

  bool is_leaf_pair(const QueuedPair& pair) const {
    return a().tree.is_leaf(pair.a) && b().tree.is_leaf(pair.b);
  }
  bool is_single_leaf_pair() const { return a().tree.convex() && b().tree.convex(); }
  /// Prefetches what open() will read.
  void fetch_parts(const QueuedPair& pair) const {
    const bool opens_a = opens_first(a().tree, pair.a, b().tree, pair.b);
    const ShapeTree& tree = opens_a ? a().tree : b().tree;
    tree.fetch(tree.child(opens_a ? pair.a : pair.b));
  }
  /// Whether the sides may stay at their current time for a pair of boxes with a later one.
  bool may_stand_still(const QueuedPair& pair) const {
    const Scalar moved = (pair.time - time()) * moving_.largest_speed();
    return moved * moved <=
           kStandingStill * kStandingStill *
               (a().tree.squared_half_diagonal(pair.a) + b().tree.squared_half_diagonal(pair.b));
  }

  /// Calls push(a, b, safe step, is far) for each part of the larger box; returns their number.
  template <typename Push>
  int open(const QueuedPair& pair, const Push& push);
  /// Calls push(safe step, is far) for the pair itself.
  template <typename Push>
  void advance(const QueuedPair& pair, const Push& push);

  PieceDistance measure(const QueuedPair& pair, Scalar noise, const GjkGoal& goal,
                        GjkSeed& seed) const {
    return piece_distance(a().tree, pair.a, b().tree, pair.b, moving_.X_AB(), noise, goal, seed);
  }
  Scalar leaf_step(const PieceDistance& piece, const QueuedPair& pair, Scalar least) {
    return moving_.leaf_step(piece, pair.a, pair.b, least);
  }
  Scalar closing_speed(const PieceDistance& piece, const QueuedPair& /*pair*/) const {
    return moving_.closing_speed(piece);
  }
  bool is_closing(const PieceDistance& piece, const QueuedPair& /*pair*/) const {
    return moving_.is_closing(piece);
  }
  DistanceTraversal nearer_search(Scalar max_distance, BoxPairStack& stack) const {
    return DistanceTraversal(a().tree, b().tree, moving_.X_AB(), noise(), max_distance, stack);
  }

  WitnessPair witness_pair(const PieceDistance& piece, const QueuedPair& pair) const {
    return distance_internal::witness_pair(piece, a().tree, pair.a, b().tree, pair.b,
                                           pose_of(moving_.now().a));
  }
  std::pair<RigidPose, RigidPose> poses(Scalar t) const;
  /// An upper bound on the distance at the current time: of the points that touch in a result.
  Scalar witness_distance(const ToiResult& impact) const;
  /// At the current time.
  std::vector<Contact> contacts_within(Scalar reach) const;

 private:
  // Two boxes are examined at the time of the previous pair if, until their own time, the bodies
  // move by less than this fraction of the boxes' half diagonals: computing poses costs more than
  // such a fraction of a step.
  static constexpr Scalar kStandingStill = 0.05;

  const MovingShape& a() const { return moving_.a(); }
  const MovingShape& b() const { return moving_.b(); }
  static RigidPose pose_of(const BodyInstant& body) {
    return RigidPose::from_trusted(body.R_WB, body.p_WB);
  }
  Scalar skip_turns();
  Scalar step_of_balls();
  void step_further(BoxStepsKernel kernel, const GroupRows& rows, int first, int count,
                    const FacingPiece& other, bool from_a, BoxSteps& steps);

  const BoxStepsKernels kernels_;
  MovingPair moving_;
  const Scalar first_target_;  // of the steps before any box or leaf is examined
  const std::span<const BoxPair> first_pairs_;
};

template <typename Push>
int RigidPair::open(const QueuedPair& pair, const Push& push) {
  const bool opens_a = opens_first(a().tree, pair.a, b().tree, pair.b);
  const ShapeTree& tree = opens_a ? a().tree : b().tree;
  const std::int32_t child = tree.child(opens_a ? pair.a : pair.b);
  const int count = tree.node(child).count();
  const FacingPiece other = moving_.facing_piece(opens_a, opens_a ? pair.b : pair.a);
  BoxSteps steps;
  kernels_.group(tree.rows(child), 0, count, other, moving_.facing_motion(opens_a), &steps);
  if (!moving_.is_smooth()) {
    step_further(kernels_.group, tree.rows(child), 0, count, other, opens_a, steps);
  }
  for (int column = 0; column < count; ++column) {
    const std::int32_t part = ShapeTree::box_number(child, column);
    push(opens_a ? part : pair.a, opens_a ? pair.b : part, steps.time[column],
         (steps.is_far >> column & 1) != 0);
  }
  return count;
}

template <typename Push>
void RigidPair::advance(const QueuedPair& pair, const Push& push) {
  const int column = ShapeTree::column_of(pair.a);
  const GroupRows& rows = a().tree.rows(pair.a / BoxGroup::kWidth);
  const FacingPiece other = moving_.facing_piece(true, pair.b);
  BoxSteps steps;
  kernels_.one(rows, column, 1, other, moving_.facing_motion(true), &steps);
  if (!moving_.is_smooth()) step_further(kernels_.one, rows, column, 1, other, true, steps);
  push(steps.time[column], steps.is_far != 0);
}

/// As time_of_impact(), but of the given pairs of boxes only: what is proven holds if all others
/// are proven apart otherwise.
/// @param pairs Boxes of the two shapes' trees; their gaps are not used. Must outlive the call.
DYOP_EXPORT ToiResult time_of_listed_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                            const Motion& X_WB, const TimeInterval& interval,
                                            const ToiOptions& options, ToiWorkspace& workspace,
                                            std::span<const BoxPair> pairs);

}  // namespace dyop::toi_internal
