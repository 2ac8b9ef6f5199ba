// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/batch_options.h"
#include "dyop/toi/time_of_impact.h"

namespace DYOP_EXPORT dyop {

/// One time-of-impact query of a batch: the arguments of time_of_impact(). Shapes and motions
/// belong to the caller, may be shared by any number of queries, and must not change until the
/// batch returns.
struct ToiQuery {
  const Shape* a = nullptr;
  const Motion* X_WA = nullptr;
  const Shape* b = nullptr;
  const Motion* X_WB = nullptr;
  TimeInterval interval;
  ToiOptions options;  ///< its own stop token ends this query only
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
