// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "distance/distance_traversal.h"
#include "distance/piece_distance.h"
#include "dyop/core/export.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "dyop/toi/time_of_impact.h"
#include "hierarchy/split_tree.h"
#include "toi/deforming/deforming_sides.h"
#include "toi/deforming/deforming_traversal.h"
#include "toi/impact_band.h"
#include "toi/radix_queue.h"
#include "toi/rigid/box_steps.h"

namespace dyop::toi_internal {

/// A deforming mesh and a side of either kind, for BestFirstSearch. The frame of pieces is the
/// world.
template <typename SideB>
class DeformingPair {
 public:
  /// All arguments must outlive the pair.
  /// @param first The pairs of nodes to examine: by default, the roots.
  DeformingPair(DeformingSide& a, SideB& b, const TimeInterval& interval, const ImpactBand& band,
                std::span<const BoxPair> first = {&kRootPair, 1});

  void set_time(Scalar t);
  Scalar time() const { return time_; }
  Scalar noise() const { return now_.noise; }
  /// The noise of the positions at the start, whatever the speeds.
  Scalar start_noise() const { return kPoseNoise * (a_.start_size() + b_.start_size()); }

  Scalar first_time() const { return interval_.begin; }
  std::span<const BoxPair> first_pairs() const { return first_; }
  /// Deforming meshes are surfaces.
  std::optional<Vector3> enclosed_point(const ToiOptions& /*options*/) const {
    return std::nullopt;
  }

  bool is_leaf_pair(const QueuedPair& pair) const {
    return a_.is_leaf(pair.a) && b_.is_leaf(pair.b);
  }
  bool is_single_leaf_pair() const { return false; }
  void fetch_parts(const QueuedPair& /*pair*/) const {}
  /// Positions cost little.
  bool may_stand_still(const QueuedPair& /*pair*/) const { return false; }

  /// As in RigidPair.
  template <typename Push>
  int open(const QueuedPair& pair, const Push& push) const;
  template <typename Push>
  void advance(const QueuedPair& pair, const Push& push) const {
    push_step(pair, a_.box_W(pair.a), b_.box_W(pair.b), push);
  }

  PieceDistance measure(const QueuedPair& pair, Scalar noise, const GjkGoal& /*goal*/,
                        GjkSeed& /*seed*/) const {
    return measure(pair.a, pair.b, noise);
  }
  Scalar leaf_step(const PieceDistance& piece, const QueuedPair& pair, Scalar least) const;
  Scalar closing_speed(const PieceDistance& piece, const QueuedPair& pair) const {
    return piece.nhat_AB.dot(a_.velocity_at(pair.a, piece.p_a) - b_.velocity_at(pair.b, piece.p_b));
  }
  bool is_closing(const PieceDistance& piece, const QueuedPair& pair) const;
  DeformingTraversal<SideB> nearer_search(Scalar max_distance, BoxPairStack& stack) const {
    return DeformingTraversal<SideB>(a_, b_, noise(), max_distance, stack, first_);
  }

  WitnessPair witness_pair(const PieceDistance& piece, const QueuedPair& pair) const;
  /// Leaves the sides at the time t.
  std::pair<RigidPose, RigidPose> poses(Scalar t) {
    if (t != time_) set_time(t);
    return {a_.pose(), b_.pose()};
  }
  std::vector<Contact> contacts_within(Scalar reach) const;
  /// None: a result does not tell where on the mesh its points are.
  Scalar witness_distance(const ToiResult& /*impact*/) const { return kInfinity; }

 private:
  PieceDistance measure(std::int32_t leaf_a, std::int32_t leaf_b, Scalar noise) const {
    return leaf_distance(a_, leaf_a, b_, leaf_b, noise);
  }
  template <typename SupportA, typename SupportB>
  SafeStep safe_step(const QueuedPair& pair, const SupportA& a, const SupportB& b,
                     Scalar least) const;
  template <typename Push>
  void push_step(const QueuedPair& pair, const OrientedBox& box_a, const OrientedBox& box_b,
                 const Push& push) const;

  DeformingSide& a_;
  SideB& b_;
  const TimeInterval interval_;
  const ImpactBand& band_;
  const std::span<const BoxPair> first_;
  PairInstant now_;  // only noise, horizon and remaining are used
  Scalar time_ = 0;
};

template <typename SideB>
template <typename SupportA, typename SupportB>
SafeStep DeformingPair<SideB>::safe_step(const QueuedPair& pair, const SupportA& a,
                                         const SupportB& b, Scalar least) const {
  const auto gap_at = [&](Scalar u, Scalar q) { return -b.at(u, q) - a.at(u, q) - least; };
  SafeStep step = coupled_step(now_, b_.rest(pair.b, b), gap_at);
  if (step.gap > 0 && step.time < now_.remaining) {
    // Holds across jumps of the rigid body's twist, where accelerations are infinite.
    const Scalar speed = a_.speed(pair.a) + b_.speed(pair.b);
    const Scalar by_speed = speed >= 0 ? step.gap / speed : 0;  // NaN (infinite bound): no step
    step.time = std::max(step.time, by_speed);
  }
  if (step.gap > 0 && step.time >= now_.remaining) step.time = kInfinity;
  return step;
}

// Calls push(safe step, is far) for a pair of boxes.
template <typename SideB>
template <typename Push>
void DeformingPair<SideB>::push_step(const QueuedPair& pair, const OrientedBox& box_a,
                                     const OrientedBox& box_b, const Push& push) const {
  const Vector3 n_W = separating_direction(box_a, box_b);
  const SafeStep step =
      safe_step(pair, a_.box_support(pair.a, n_W), b_.box_support(pair.b, -n_W), band_.box_target);
  const Scalar size = box_a.half_extents.norm() + box_b.half_extents.norm();
  push(step.time, step.gap > kReadvanceRatio * size);
}

template <typename SideB>
template <typename Push>
int DeformingPair<SideB>::open(const QueuedPair& pair, const Push& push) const {
  const OrientedBox box_a = a_.box_W(pair.a);
  const OrientedBox box_b = b_.box_W(pair.b);
  const bool opens_a =
      !a_.is_leaf(pair.a) &&
      (b_.is_leaf(pair.b) || box_a.half_extents.squaredNorm() >= box_b.half_extents.squaredNorm());
  const int count = opens_a ? a_.part_count(pair.a) : b_.part_count(pair.b);
  for (int i = 0; i < count; ++i) {
    const QueuedPair part{pair.time, opens_a ? a_.part(pair.a, i) : pair.a,
                          opens_a ? pair.b : b_.part(pair.b, i)};
    push_step(part, opens_a ? a_.box_W(part.a) : box_a, opens_a ? box_b : b_.box_W(part.b),
              [&](Scalar step, bool is_far) { push(part.a, part.b, step, is_far); });
  }
  return count;
}

/// As time_of_impact() of a part of a deforming mesh's interval, but of the given pairs of nodes or
/// triangles only: what is proven holds if all others are proven apart otherwise.
/// @param pairs Nodes of A, boxes of B's hierarchy; their gaps are not used. Must outlive the call.
DYOP_EXPORT ToiResult time_of_listed_impact(const DeformingMesh& a, const DeformingSpan& span,
                                            const TriangleMesh& b, const Motion& X_WB,
                                            const TimeInterval& interval, const ToiOptions& options,
                                            ToiWorkspace& workspace,
                                            std::span<const BoxPair> pairs);

}  // namespace dyop::toi_internal
