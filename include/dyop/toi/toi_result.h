// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string_view>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/distance/distance_result.h"

namespace DYOP_EXPORT dyop {

/// How a time-of-impact query ended, and what that promises. This table is the only statement of
/// the promise; it holds for every query: rigid shapes, deforming meshes, vertex paths and batches.
///
/// δ = target_distance, ε = distance_tolerance, d(t) = distance of the two sides at time t, on
/// the motions as given, ν = the result's rounding_allowance (a length, for which
/// docs/algorithms/time_of_impact.md has the proof). So after any proof sides are apart even for
/// δ = 0, as long as ε > 4 ν.
///
///     status                 t_safe   d on [begin, t_safe]   d(t_safe)          contact
///     NotRun                 begin    nothing                nothing            none
///     Separated              end      >= δ + ε/4 - ν         the same           none
///     Impact                 any      >= δ + ε/4 - ν         <= δ + ε + ν       the pair
///     InitiallyWithinTarget  begin    nothing                <= δ + ε + ν (1)   the pair (1)
///     BudgetExhausted        any      >= δ + ε/4 - ν (2)     the same           none
///     Cancelled              any      >= δ + ε/4 - ν (2)     the same           none
///     NumericalLimit         any      >= δ + ε/4 - ν (2)     the same           the pair
///
/// (1) The lower bound of the pair's distance is at most δ + ε/4: it is not proven apart. Or, for
///     a solid: part of the other side is inside it, however far from its surface; both witness
///     points are then one point inside, and the rest of `contact` means nothing.
/// (2) If t_safe > begin. If t_safe = begin nothing is known.
///
/// The last three are undecided after t_safe: NOT a miss. NumericalLimit: rounding rules out the
/// requested tolerance.
///
/// contact    Its distance bounds are those of the pair of pieces that ended the search, at t_safe;
///            d(t_safe) is at most `upper`.
/// contacts   Impact under ToiOptions::with_contacts: all contacts at t_safe whose gap is at most
///            ε larger than that of `contact`, rounding allowed for, as find_contacts() gives
///            them; never empty. Otherwise empty.
/// t_hit      Impact, if a short probe found one: in (t_safe, end], with
///            d(t_hit) <= δ + ε/2 + ν. So [t_safe, *t_hit] brackets the time at which d falls to
///            δ + ε/2. Otherwise none.
/// X_WA, X_WB Poses at t_safe; the identity for a deforming mesh, and in NotRun.
///
/// Under ContactRule::Exact (vertex paths) Separated means d > 0 on the whole interval instead,
/// exactly; and every other status but NotRun only occurs if the two sides have a point in common
/// at an instant of the interval.
enum class ToiStatus {
  NotRun,
  Separated,              ///< no impact in the whole interval
  Impact,                 ///< in contact at t_safe, and closing, as far as rounding can tell
  InitiallyWithinTarget,  ///< not proven apart at the start
  BudgetExhausted,        ///< undecided: the budget ran out or the deadline passed
  Cancelled,              ///< undecided: stopped by the caller
  NumericalLimit,         ///< undecided: rounding rules out the requested tolerance
};

/// The enumerator's name.
std::string_view name_of(ToiStatus status);
std::ostream& operator<<(std::ostream& out, ToiStatus status);

struct ToiStatistics {
  std::int64_t box_tests = 0;   ///< pairs of bounding boxes examined
  std::int64_t leaf_tests = 0;  ///< pairs of triangles or convex pieces examined
  std::int64_t node_pairs = 0;  ///< pairs of nodes examined; what the budget counts
  std::int64_t peak_queue = 0;  ///< largest length of the queue
};

/// The pair of pieces that ended a search.
struct ImpactContact : Contact {
  Scalar closing_speed = 0;  ///< -d/dt of the gap along the normal at the witness points
};

/// Result of time_of_impact(). ToiStatus states what each member promises in each status.
struct ToiResult {
  ToiStatus status = ToiStatus::NotRun;
  Scalar t_safe = 0;
  std::optional<Scalar> t_hit;
  std::optional<ImpactContact> contact;
  std::vector<Contact> contacts;
  RigidPose X_WA;
  RigidPose X_WB;
  Scalar rounding_allowance = 0;  ///< length
  ToiStatistics statistics;
};

/// Status and times, on one line.
std::ostream& operator<<(std::ostream& out, const ToiResult& result);

}  // namespace dyop
