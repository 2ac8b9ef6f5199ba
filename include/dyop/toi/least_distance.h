// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/time_interval.h"
#include "dyop/distance/distance_result.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// How a least-distance query ended. The bounds hold in every status but NotRun.
enum class LeastDistanceStatus {
  NotRun,
  Bounded,                 ///< upper - lower is at most the tolerance
  FartherThanMaxDistance,  ///< proven: lower > max_distance
  BudgetExhausted,         ///< the bounds are farther apart than the tolerance, lower may be zero
  Cancelled,               ///< as BudgetExhausted, but stopped by the caller
  NumericalLimit,          ///< rounding keeps the bounds farther apart than the tolerance
};

struct LeastDistanceOptions {
  /// How far apart the bounds may stay: the largest of an absolute tolerance (length, >= 0), a
  /// relative one (in [0, 1), times upper), and 64 rounding allowances of the query. A tight
  /// tolerance costs little.
  Scalar absolute_tolerance = 0;
  Scalar relative_tolerance = 0.01;
  /// Stop as soon as the shapes are proven to stay farther apart than this; length, >= 0.
  Scalar max_distance = kInfinity;
  /// Treat A (B) as a solid, as in ToiOptions.
  bool solid_a = false;
  bool solid_b = false;
  /// Largest number of node pairs of the proof, as in ToiOptions.
  std::int64_t max_node_pairs = 10'000'000;
  /// Time at which to stop the proof. The search before it, some 30 distance queries, always runs.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  std::stop_token stop = {};
};

/// Result of least_distance(). With d(t) the distance at time t:
///     lower <= d(t)  for all t of the interval,   d(t_upper) <= upper,
/// in every status but NotRun, rounding included.
struct LeastDistanceResult {
  LeastDistanceStatus status = LeastDistanceStatus::NotRun;
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Scalar t_upper = 0;      ///< time of the nearest approach found
  DistanceResult nearest;  ///< distance and witness points at t_upper
  RigidPose X_WA;          ///< poses at t_upper
  RigidPose X_WB;
  Scalar rounding_allowance = 0;      ///< length; already within the bounds
  std::int64_t distance_queries = 0;  ///< at single times
  ToiStatistics statistics;           ///< of the proof
};

/// Returns the least distance of two moving shapes over an interval, with proven bounds and the
/// time of nearest approach: the clearance of a motion.
///
/// First a search finds the nearest approach, then time_of_impact() proves that the distance never
/// falls below it by more than the tolerance, or finds where it does.
///
/// @param a, b, X_WA, X_WB, interval  As for time_of_impact().
/// @throws InvalidArgument if an option is out of range, a motion is undefined on `interval`, or a
///         solid is a mesh that is not closed.
/// Reads the shapes only; thread-safe, deterministic unless a deadline or stop ends it.
/// See docs/algorithms/least_distance.md.
LeastDistanceResult least_distance(const Shape& a, const Motion& X_WA, const Shape& b,
                                   const Motion& X_WB, const TimeInterval& interval,
                                   const LeastDistanceOptions& options = {});

}  // namespace dyop
