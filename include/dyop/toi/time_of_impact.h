// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "dyop/core/time_interval.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/toi_result.h"
#include "dyop/toi/toi_workspace.h"

namespace DYOP_EXPORT dyop {

struct ToiOptions {
  /// Gap at which two shapes count as touching; length, >= 0.
  Scalar target_distance = 0;
  /// How much above the target an impact may be reported; length, > 0. Halving it costs little.
  /// Default: a millionth of the smaller bounding radius, see default_distance_tolerance().
  std::optional<Scalar> distance_tolerance = {};
  /// Largest number of node pairs to examine. Spent: BudgetExhausted.
  std::int64_t max_node_pairs = 10'000'000;
  /// Point in time to stop at: BudgetExhausted. Checked every 64 node pairs.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  /// Gather all contacts of an impact, not only the first: ToiResult::contacts. Work that grows
  /// with their number (for a deforming mesh with its size), that no budget counts and that
  /// allocates.
  bool with_contacts = false;
  /// Take A (B) for a solid, not for a surface: a pair of which a part starts inside the other is
  /// InitiallyWithinTarget. A mesh must be closed; convex shapes are solids anyway. Not for
  /// deforming meshes.
  bool solid_a = false;
  bool solid_b = false;
  /// Cooperative cancellation: Cancelled.
  std::stop_token stop = {};
};

/// The tolerance of a query that names none: a millionth of the smaller of two bounding radii, of
/// the larger if the smaller is zero.
/// @throws InvalidArgument if both are zero: points have no size to go by.
Scalar default_distance_tolerance(Scalar radius_a, Scalar radius_b);

/// Returns when two moving shapes first come within target_distance, or proves that they do not.
///
/// ToiStatus states what is promised. Best-first conservative advancement over pairs of hierarchy
/// nodes, each keyed by a time before which that pair is proven apart.
///
/// A pair that begins, or passes, between δ + ε/4 and δ + ε while moving apart is not an impact:
/// so a body that leaves a contact is not held by it.
///
/// @param a, b       Shapes, each in its own frame. For meshes the surfaces count, for convex
/// shapes the solids.
/// @param X_WA, X_WB Motions of A and B in world; defined on all of `interval`.
/// @param interval   Finite, not reversed; a length of zero is legal.
/// @throws InvalidArgument if an option is out of range, a motion is undefined on `interval`, or a
///         solid is a mesh that is not closed.
/// Const, thread-safe, deterministic unless a deadline or stop ends it.
/// See [Mirtich1996], [Tang2009], docs/algorithms/time_of_impact.md.
ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options = {});

/// The same, in the memory of `workspace`: no allocation once that has grown. Same result, bit for
/// bit.
ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace);

/// Goes on with the last query of `workspace`, which ended in BudgetExhausted or Cancelled, under
/// new budgets. Ends as the query would have with the sum of the budgets; t_safe never falls.
/// Statistics count this call only.
/// @throws InvalidArgument if the workspace holds no such query, or one of other shapes, motions
///         (the same objects, unchanged), interval, target or tolerance.
ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace);

}  // namespace dyop
