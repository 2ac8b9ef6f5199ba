// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/batch_options.h"
#include "dyop/distance/distance.h"

namespace DYOP_EXPORT dyop {

/// One distance query of a batch: the arguments of distance(). Shapes belong to the caller, may be
/// shared by any number of queries, and must not change until the batch returns.
struct DistanceQuery {
  const Shape* a = nullptr;
  RigidPose X_WA;
  const Shape* b = nullptr;
  RigidPose X_WB;
  DistanceOptions options;
  /// Warm start read and updated by the query, as for distance(); null for none. No two queries of
  /// a batch may share one.
  DistanceCache* cache = nullptr;
};

/// Answers many distance queries on several threads: results[i] is bit for bit what distance()
/// returns for queries[i], for any number of threads. After a stop, queries that were not started
/// have status NotRun; all others are answered.
/// @throws InvalidArgument before any query is run if the spans differ in length, thread_count is
///         negative, or a query lacks a shape or would be refused by distance(); the message names
///         the lowest such index. An exception from the progress callback ends the batch as a stop
///         does.
void distance_batch(std::span<const DistanceQuery> queries, std::span<DistanceResult> results,
                    const BatchOptions& options = {});

}  // namespace dyop
