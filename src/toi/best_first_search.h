// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "distance/gjk/warm_gjk.h"
#include "distance/piece_distance.h"
#include "dyop/toi/time_of_impact.h"
#include "toi/impact_band.h"
#include "toi/toi_memory.h"

namespace dyop::toi_internal {

/// What can end a search undecided: its budget, its deadline or its stop token.
class Interruption {
 public:
  /// How often the clock and the stop token are checked, in node pairs.
  static constexpr std::int64_t kPollInterval = 16;

  explicit Interruption(const ToiOptions& options) : options_(options) {}

  /// Call this before every node pair, or after a portion of them.
  std::optional<ToiStatus> after(std::int64_t node_pairs) {
    if (node_pairs >= options_.max_node_pairs) {
      status_ = ToiStatus::BudgetExhausted;
    } else if (node_pairs >= next_poll_) {
      next_poll_ = node_pairs + kPollInterval;
      status_ = from_outside();
    }
    return status_;
  }
  /// The last result of after().
  std::optional<ToiStatus> status() const { return status_; }

  /// How many node pairs may be processed before the next check.
  std::int64_t portion(std::int64_t node_pairs) const {
    return std::min(kPollInterval, options_.max_node_pairs - node_pairs);
  }

 private:
  // Checks the clock and the stop token.
  std::optional<ToiStatus> from_outside() const {
    if (options_.stop.stop_requested()) return ToiStatus::Cancelled;
    if (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline) {
      return ToiStatus::BudgetExhausted;
    }
    return std::nullopt;
  }

  const ToiOptions& options_;
  std::int64_t next_poll_ = 0;
  std::optional<ToiStatus> status_;
};

/// Best-first conservative advancement, the one search of all queries on trees of boxes
/// (docs/algorithms/time_of_impact.md, "Search"). `Pair` is the two sides at one time of the
/// interval: RigidPair or DeformingPair. It knows how they move; this class does not:
///
///     set_time, time, noise            where the sides are; rounding allowance of a gap
///     first_time                       a time proven safe before any box is examined, or infinity
///     first_pairs                      what it starts with
///     is_leaf_pair, fetch_parts, may_stand_still    of a pair in the queue
///     open, advance                    safe steps of the parts of a pair of boxes, or of itself
///     measure, leaf_step               distance and safe step of two leaves
///     closing_speed, is_closing        of two leaves
///     is_single_leaf_pair, nearer_search, start_noise, enclosed_point
///     witness_pair, poses, contacts_within    what a result consists of
///     witness_distance                 of its two points, later
///
/// Instantiated for both in best_first_search.cpp.
template <typename Pair>
class BestFirstSearch {
 public:
  /// All arguments must outlive the search. The pair must be at the start of the interval.
  BestFirstSearch(Pair& pair, const TimeInterval& interval, const ToiOptions& options,
                  const ImpactBand& band, ToiMemory& memory)
      : pair_(pair),
        interval_(interval),
        options_(options),
        band_(band),
        memory_(memory),
        interruption_(options) {}

  /// From the start of the interval.
  ToiResult run();
  /// Continues from what the memory holds.
  ToiResult resume();

 private:
  enum class Verdict { GoOn, Impact, TooCloseAtBegin, Stuck, Interrupted };

  // Set in the number of the second box of a pair that is far apart for its size: it is advanced in
  // time before it is split.
  static constexpr std::int32_t kFarFlag = std::int32_t{1} << 30;

  // How far apart the bounds of a rough distance may be, as a fraction of the distance left to the
  // target. Larger: shorter steps; smaller: more work per step.
  static constexpr Scalar kRoughShare = 0.25;

  // Keeps every pair that is not proven apart to the end.
  void push(Scalar time, std::int32_t box_a, std::int32_t box_b) {
    if (time != kInfinity) memory_.queue.push({time, box_a, box_b});
  }
  ToiResult search();
  void examine_boxes(const QueuedPair& pair, bool is_far);
  Verdict examine_leaves(const QueuedPair& pair);
  Verdict examine_start(const QueuedPair& pair, const PieceDistance& piece);
  std::optional<bool> is_nearest(const PieceDistance& piece);
  PieceDistance measure(const QueuedPair& pair, const GjkGoal& goal) {
    return pair_.measure(pair, pair_.noise(), goal, memory_.seed);
  }
  ImpactContact make_contact(const PieceDistance& piece, const QueuedPair& pair) const {
    return {pair_.witness_pair(piece, pair), pair_.closing_speed(piece, pair)};
  }
  std::optional<Scalar> probe_hit(const QueuedPair& pair, const ToiResult& impact);
  ToiResult finish(ToiStatus status, Scalar t_safe);
  ToiResult finish_impact(const QueuedPair& pair);
  ToiResult finish_undecided(ToiStatus status, const QueuedPair& pair);
  ToiResult finish_enclosed(const Vector3& p_W);

  Pair& pair_;
  const TimeInterval interval_;
  const ToiOptions& options_;
  const ImpactBand& band_;
  ToiMemory& memory_;
  Interruption interruption_;
  ToiResult result_;
};

}  // namespace dyop::toi_internal
