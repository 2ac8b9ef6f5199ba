#pragma once

#include <span>

#include "dyop/core/batch_options.h"
#include "dyop/distance/distance.h"

namespace DYOP_EXPORT dyop {

/// One distance query of a batch: the arguments of distance(). Shapes are the caller's, may be
/// shared by any number of queries, and must stay as they are until the batch returns.
struct DistanceQuery {
  const Shape* a = nullptr;
  RigidPose X_WA;
  const Shape* b = nullptr;
  RigidPose X_WB;
  DistanceOptions options;
  /// Where to start from and what to remember, as for distance(); null: neither. No two queries of
  /// a batch may share one.
  DistanceCache* cache = nullptr;
};

/// Answers many distance queries over several threads: results[i] is bit for bit what distance()
/// returns for queries[i], for every number of threads. After a stop the status of each query that
/// was not begun is NotRun; all others are answered.
/// @throws InvalidArgument before any query is run if the spans differ in length, thread_count is
///         negative, or a query is one that distance() refuses or lacks a shape; the message names
///         the lowest such index. What the progress callback throws ends the batch as a stop does.
void distance_batch(std::span<const DistanceQuery> queries, std::span<DistanceResult> results,
                    const BatchOptions& options = {});

}  // namespace dyop
