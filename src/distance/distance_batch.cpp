// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance_batch.h"

#include <algorithm>

#include "core/batch_run.h"
#include "distance/distance_check.h"
#include "dyop/core/error.h"

namespace dyop {

void distance_batch(std::span<const DistanceQuery> queries, std::span<DistanceResult> results,
                    const BatchOptions& options) {
  DYOP_REQUIRE(queries.size() == results.size(), "distance: ", queries.size(),
               " queries, but space for ", results.size(), " results");
  for (std::size_t i = 0; i < queries.size(); ++i) {
    DYOP_REQUIRE(queries[i].a && queries[i].b, "query ", i, ": a shape is missing");
    distance_internal::require_valid_options(queries[i].options, "query ", i);
  }
  std::fill(results.begin(), results.end(), DistanceResult());
  core_internal::run_batch(queries.size(), options, [&](std::size_t index, std::size_t) {
    const DistanceQuery& query = queries[index];
    DistanceCache cold;
    results[index] = distance(*query.a, query.X_WA, *query.b, query.X_WB, query.options,
                              query.cache ? *query.cache : cold);
  });
}

}  // namespace dyop
