// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/toi_batch.h"

#include <optional>
#include <vector>

#include "core/batch_run.h"
#include "dyop/core/error.h"
#include "toi/toi_check.h"

namespace dyop {
namespace {

using core_internal::EitherStop;

void require_valid(const ToiQuery& query, std::size_t index) {
  DYOP_REQUIRE(query.a && query.b, "query ", index, ": a shape is missing");
  DYOP_REQUIRE(query.X_WA && query.X_WB, "query ", index, ": a motion is missing");
  try {
    toi_internal::require_valid_query(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval,
                                      query.options);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(core_internal::compose_message("query ", index, ": ", error.what()));
  }
}

ToiResult answer(const ToiQuery& query, const std::stop_token& stop, ToiWorkspace& workspace) {
  const auto run = [&](const ToiOptions& options) {
    return time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, options,
                          workspace);
  };
  if (!stop.stop_possible()) return run(query.options);
  std::optional<EitherStop> either;
  if (query.options.stop.stop_possible()) either.emplace(query.options.stop, stop);
  ToiOptions options = query.options;
  options.stop = either ? either->token() : stop;
  return run(options);
}

}  // namespace

void time_of_impact_batch(std::span<const ToiQuery> queries, std::span<ToiResult> results,
                          const BatchOptions& options) {
  DYOP_REQUIRE(queries.size() == results.size(), "time_of_impact: ", queries.size(),
               " queries, but space for ", results.size(), " results");
  for (std::size_t i = 0; i < queries.size(); ++i) require_valid(queries[i], i);
  std::vector<ToiWorkspace> workspaces(core_internal::batch_worker_count(queries.size(), options));
  for (std::size_t i = 0; i < queries.size(); ++i) {
    results[i] = ToiResult();
    results[i].t_safe = queries[i].interval.begin;
  }
  core_internal::run_batch(queries.size(), options, [&](std::size_t index, std::size_t worker) {
    results[index] = answer(queries[index], options.stop, workspaces[worker]);
  });
}

}  // namespace dyop
