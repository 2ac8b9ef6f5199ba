#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/distance/witness_pair.h"

namespace dyop {

/// How a time-of-impact query ended. In every status but NotRun the guarantee on t_safe holds.
enum class ToiStatus {
  NotRun,
  Separated,              ///< proven: no impact in the whole interval; t_safe is its end
  Impact,                 ///< at t_safe the distance is at most target + tolerance, and closing
  InitiallyWithinTarget,  ///< the shapes begin within δ + ε/4: nothing is guaranteed; t_safe is the
                          ///< begin
  BudgetExhausted,        ///< undecided after t_safe: NOT a miss
  Cancelled,              ///< stopped by the caller; undecided after t_safe
  NumericalLimit,         ///< rounding forbids the tolerance asked for; undecided after t_safe
};

struct ToiStatistics {
  std::int64_t box_tests = 0;   ///< pairs of bounding boxes examined
  std::int64_t leaf_tests = 0;  ///< pairs of triangles or convex pieces examined
  std::int64_t node_pairs = 0;  ///< pairs taken from the queue; what the budget counts
  std::int64_t peak_queue = 0;  ///< largest length of the queue
};

/// The contact found at the time of impact.
struct ImpactContact : Contact {
  Scalar closing_speed = 0;  ///< -d/dt of the gap along the normal at the witness points
};

/// Result of time_of_impact(). With δ = target_distance, ε = distance_tolerance and d(t) the
/// distance at time t:
///     d(t) >= δ + ε/4 - (rounding allowance)   for all t in [begin, t_safe]
/// in every status but NotRun and InitiallyWithinTarget (where t_safe = begin), and for Impact
///     d(t_safe) <= δ + ε + (rounding allowance).
/// So bodies at t_safe are apart even for δ = 0. Where an undecided query ends with t_safe = begin,
/// nothing is known but where it ended. The allowance is derived in
/// docs/algorithms/time_of_impact.md and reported in `rounding_allowance`.
struct ToiResult {
  ToiStatus status = ToiStatus::NotRun;
  Scalar t_safe = 0;
  /// Impact: a time shortly after t_safe at which the pair in contact is proven to be closer than
  /// δ + ε/2 (or to cross), if one was found by a short probe: [t_safe, *t_hit] brackets the time
  /// at which that distance is reached.
  std::optional<Scalar> t_hit;
  /// Impact and InitiallyWithinTarget; NumericalLimit: the pair that rounding stopped the search
  /// at.
  std::optional<ImpactContact> contact;
  /// Impact, if ToiOptions::with_contacts: all contacts at t_safe whose gap is at most ε larger
  /// than that of `contact`, rounding allowed for. As find_contacts() gives them, never empty.
  std::vector<Contact> contacts;
  RigidPose X_WA;  ///< poses at t_safe
  RigidPose X_WB;
  Scalar rounding_allowance = 0;  ///< length
  ToiStatistics statistics;
};

}  // namespace dyop
