// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/time_of_impact.h"

#include <optional>
#include <ostream>
#include <vector>

#include "core/batch_run.h"
#include "dyop/core/error.h"
#include "dyop/toi/toi_result.h"
#include "toi/best_first_search.h"
#include "toi/rigid/rigid_pair.h"
#include "toi/rigid/straight_impact.h"
#include "toi/toi_check.h"
#include "toi/toi_memory.h"

namespace dyop {
namespace {

using distance_internal::BoxPair;
using toi_internal::ImpactBand;
using toi_internal::RigidPair;
using toi_internal::RigidQuery;
using toi_internal::ToiMemory;
using toi_internal::ToiSubject;
using toi_internal::WorkspaceUse;

using RigidSearch = toi_internal::BestFirstSearch<RigidPair>;

ImpactBand band_of(const Shape& a, const Shape& b, const ToiOptions& options) {
  return {options.target_distance, options.distance_tolerance ? *options.distance_tolerance
                                                              : default_distance_tolerance(a, b)};
}

ToiResult search(const RigidQuery& query, ToiMemory& memory,
                 std::span<const BoxPair> pairs = {&distance_internal::kRootPair, 1}) {
  RigidPair pair(query.a, query.X_WA, query.b, query.X_WB, query.interval, query.band, pairs);
  memory.subject =
      ToiSubject(&query.a, &query.X_WA, &query.b, &query.X_WB, query.interval, query.options);
  return RigidSearch(pair, query.interval, query.options, query.band, memory).run();
}

ToiResult search(const RigidQuery& query) {
  ToiMemory memory;
  return search(query, memory);
}

// In closed form where there is one.
ToiResult impact_of_balls(const RigidQuery& query, ToiMemory* memory) {
  ToiResult result;
  if (!toi_internal::straight_impact(query, result)) {
    result = memory ? search(query, *memory) : search(query);
  } else if (memory) {
    memory->forget();
  }
  return result;
}

}  // namespace

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options) {
  toi_internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const ImpactBand band = band_of(a, b, options);
  const RigidQuery query{a, X_WA, b, X_WB, interval, options, band};
  return toi_internal::are_balls_or_plane(a, b) ? impact_of_balls(query, nullptr) : search(query);
}

ToiResult time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                         const TimeInterval& interval, const ToiOptions& options,
                         ToiWorkspace& workspace) {
  toi_internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const WorkspaceUse use(workspace);
  const ImpactBand band = band_of(a, b, options);
  const RigidQuery query{a, X_WA, b, X_WB, interval, options, band};
  return toi_internal::are_balls_or_plane(a, b) ? impact_of_balls(query, &use.memory())
                                                : search(query, use.memory());
}

ToiResult resume_time_of_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                const Motion& X_WB, const TimeInterval& interval,
                                const ToiOptions& options, ToiWorkspace& workspace) {
  toi_internal::require_valid_query(a, X_WA, b, X_WB, interval, options);
  const WorkspaceUse use(workspace);
  toi_internal::require_resumable(use.memory(),
                                  ToiSubject(&a, &X_WA, &b, &X_WB, interval, options));
  const ImpactBand band = band_of(a, b, options);
  RigidPair pair(a, X_WA, b, X_WB, interval, band);
  return RigidSearch(pair, interval, options, band, use.memory()).resume();
}

ToiResult toi_internal::time_of_listed_impact(const Shape& a, const Motion& X_WA, const Shape& b,
                                              const Motion& X_WB, const TimeInterval& interval,
                                              const ToiOptions& options, ToiWorkspace& workspace,
                                              std::span<const BoxPair> pairs) {
  require_valid_query(a, X_WA, b, X_WB, interval, options);
  const WorkspaceUse use(workspace);
  const ImpactBand band = band_of(a, b, options);
  return search({a, X_WA, b, X_WB, interval, options, band}, use.memory(), pairs);
}

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

std::string_view name_of(ToiStatus status) {
  switch (status) {
    case ToiStatus::NotRun:
      return "NotRun";
    case ToiStatus::Separated:
      return "Separated";
    case ToiStatus::Impact:
      return "Impact";
    case ToiStatus::InitiallyWithinTarget:
      return "InitiallyWithinTarget";
    case ToiStatus::BudgetExhausted:
      return "BudgetExhausted";
    case ToiStatus::Cancelled:
      return "Cancelled";
    case ToiStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, ToiStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const ToiResult& result) {
  out << result.status << ": t_safe = " << result.t_safe;
  if (result.t_hit) out << ", t_hit = " << *result.t_hit;
  return out;
}

ToiWorkspace::ToiWorkspace() : memory_(std::make_unique<toi_internal::ToiMemory>()) {}
ToiWorkspace::~ToiWorkspace() = default;
ToiWorkspace::ToiWorkspace(ToiWorkspace&&) noexcept = default;
ToiWorkspace& ToiWorkspace::operator=(ToiWorkspace&&) noexcept = default;

toi_internal::ToiMemory& ToiWorkspace::memory() const {
  DYOP_REQUIRE(memory_, "this ToiWorkspace was moved from and is empty");
  return *memory_;
}

bool ToiWorkspace::can_resume() const {
  return memory().is_unfinished;
}

void ToiWorkspace::reserve(std::size_t count) {
  memory().queue.reserve(count);
  memory().box_pairs.reserve(count);
}

namespace toi_internal {

WorkspaceUse::WorkspaceUse(ToiWorkspace& workspace) : memory_(workspace.memory()) {
  DYOP_REQUIRE(
      !memory_.is_in_use.exchange(true, std::memory_order_acquire),
      "time_of_impact: the workspace is in use by another query; give each thread its own");
}

}  // namespace toi_internal

}  // namespace dyop
