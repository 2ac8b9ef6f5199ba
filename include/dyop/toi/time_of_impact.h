// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>

#include "dyop/core/batch_options.h"
#include "dyop/core/export.h"
#include "dyop/core/time_interval.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

namespace toi_internal {
struct ToiMemory;
}

/// Memory of time_of_impact(), kept by the caller between queries: after the first few, queries of
/// two meshes allocate nothing. Also holds the state of a query that ran out of budget, so that it
/// can be resumed. Works with any pair of shapes, one query at a time. A query throws
/// InvalidArgument if the workspace is serving another one, in any thread, or was moved from.
class ToiWorkspace {
 public:
  ToiWorkspace();
  ~ToiWorkspace();
  ToiWorkspace(ToiWorkspace&&) noexcept;
  ToiWorkspace& operator=(ToiWorkspace&&) noexcept;

  /// True if the last query ended undecided (BudgetExhausted, Cancelled) and can be resumed.
  /// @throws InvalidArgument if the workspace was moved from; it can only be assigned then.
  bool can_resume() const;

  /// Grows the memory before the first query: to `count` node pairs in each of the 65 arrays of the
  /// queue, 16 bytes a pair.
  /// @throws InvalidArgument if the workspace was moved from.
  void reserve(std::size_t count);

  toi_internal::ToiMemory& memory() const;

 private:
  std::unique_ptr<toi_internal::ToiMemory> memory_;
};

struct ToiOptions {
  /// Gap at which two shapes count as touching; length, >= 0.
  Scalar target_distance = 0;
  /// How much above the target an impact may be reported; length, > 0. Halving it costs little.
  /// See default_distance_tolerance().
  std::optional<Scalar> distance_tolerance = {};
  /// Largest number of node pairs to examine; after that the status is BudgetExhausted.
  std::int64_t max_node_pairs = 10'000'000;
  /// Time at which to stop with BudgetExhausted. Checked every 64 node pairs.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  /// Gather all contacts of an impact, not only the first: ToiResult::contacts. This work grows
  /// with the number of contacts (for a deforming mesh with its size), does not count towards any
  /// budget, and allocates.
  bool with_contacts = false;
  /// Treat A (B) as a solid, not as a surface: the pair is InitiallyWithinTarget if part of one
  /// starts inside the other. A mesh must be closed; convex shapes are always solids. Not for
  /// deforming meshes.
  bool solid_a = false;
  bool solid_b = false;
  /// Cooperative cancellation: Cancelled.
  std::stop_token stop = {};
};

/// The default tolerance of a query: 1e-6 of the size of the smaller shape (the larger, if it has
/// none), which is its bounding radius, but at most twice the diagonal of its bounding box.
/// @throws InvalidArgument if both are points, which have no size.
Scalar default_distance_tolerance(const Shape& a, const Shape& b);

/// Returns when two moving shapes first come within target_distance, or proves that they do not.
///
/// ToiStatus states what is promised. Best-first conservative advancement over pairs of hierarchy
/// nodes, each keyed by a time before which that pair is proven apart.
///
/// A pair that moves apart is not an impact, even if it starts or passes between δ + ε/4 and
/// δ + ε: bodies can separate from contact.
///
/// @param a, b       Shapes, each in its own frame. For meshes the surfaces count, for convex
/// shapes the solids.
/// @param X_WA, X_WB Motions of A and B in world; defined on all of `interval`.
/// @param interval   Finite, not reversed; a length of zero is legal.
/// @throws InvalidArgument if an option is out of range, a motion is undefined on `interval`, or a
///         solid is a mesh that is not closed.
/// Reads the shapes only; thread-safe, deterministic unless a deadline or stop ends it.
/// See [Mirtich1996], [Tang2009], docs/algorithms/time_of_impact.md.
ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options = {});

/// The same, in the memory of `workspace`: allocates nothing once that has grown. Same result, bit
/// for bit.
ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace);

/// Continues the last query of `workspace`, which ended in BudgetExhausted or Cancelled, with new
/// budgets. Ends as the query would have with the sum of the budgets; t_safe never decreases.
/// Statistics count this call only.
/// @throws InvalidArgument if the workspace holds no such query, or one of other shapes, motions
///         (the same objects, unchanged), interval, target or tolerance.
ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace);

/// One time-of-impact query of a batch: the arguments of time_of_impact(). Shapes and motions
/// belong to the caller, may be shared by any number of queries, and must not change until the
/// batch returns.
struct ToiQuery {
  const Shape* a = nullptr;
  const Motion* X_WA = nullptr;
  const Shape* b = nullptr;
  const Motion* X_WB = nullptr;
  TimeInterval interval = {};
  ToiOptions options = {};  ///< its own stop token ends this query only
};

/// Answers many time-of-impact queries on several threads: results[i] is bit for bit what
/// time_of_impact() returns for queries[i], for any number of threads.
///
/// After the batch is stopped, a query that was running is Cancelled; one that had not started is
/// NotRun.
///
/// @throws InvalidArgument before any query is run if the spans differ in length, thread_count is
///         negative, or a query lacks a shape or a motion or would be refused by time_of_impact();
///         the message names the lowest such index. An exception from a motion or the progress
///         callback ends the batch: results that are not NotRun are then answered.
/// Motions must allow concurrent calls, as all of dyop's do. Memory is kept per thread, not per
/// query. See docs/algorithms/time_of_impact.md, "Batches".
void time_of_impact_batch(std::span<const ToiQuery> queries, std::span<ToiResult> results,
                          const BatchOptions& options = {});

}  // namespace dyop
