// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <stop_token>

#include "c/context.h"
#include "c/convert.h"
#include "dyop/distance/distance_batch.h"
#include "dyop/toi/toi_batch.h"

namespace dyop::c {
namespace {

// The enumerators of C match those of C++, in the same order.
static_assert(int(DistanceStatus::Inconclusive) == DYOP_DISTANCE_INCONCLUSIVE);
static_assert(int(DistanceStatus::FartherThanMaxDistance) == DYOP_DISTANCE_FARTHER_THAN_MAX);
static_assert(int(DistanceStatus::Overlapping) == DYOP_DISTANCE_OVERLAPPING);
static_assert(int(ToiStatus::NumericalLimit) == DYOP_TOI_NUMERICAL_LIMIT);
static_assert(int(ToiStatus::InitiallyWithinTarget) == DYOP_TOI_INITIALLY_WITHIN_TARGET);
static_assert(int(ToiStatus::Impact) == DYOP_TOI_IMPACT);

DistanceOptions options_from(const dyop_distance_options* given) {
  const auto c = read_struct<dyop_distance_options>(given, DYOP_DISTANCE_OPTIONS_INIT,
                                                    "dyop_distance_options");
  DistanceOptions options;
  options.max_distance = c.max_distance;
  options.absolute_tolerance = c.absolute_tolerance;
  options.relative_tolerance = c.relative_tolerance;
  options.solid_a = c.solid_a != 0;
  options.solid_b = c.solid_b != 0;
  return options;
}

ToiOptions options_from(const dyop_toi_options* given) {
  const auto c = read_struct<dyop_toi_options>(given, DYOP_TOI_OPTIONS_INIT, "dyop_toi_options");
  ToiOptions options;
  options.target_distance = c.target_distance;
  if (c.distance_tolerance != 0) options.distance_tolerance = c.distance_tolerance;
  options.max_node_pairs = c.max_node_pairs;
  options.solid_a = c.solid_a != 0;
  options.solid_b = c.solid_b != 0;
  return options;
}

BatchOptions options_from(const dyop_batch_options* given, std::stop_source& stop) {
  const auto c =
      read_struct<dyop_batch_options>(given, DYOP_BATCH_OPTIONS_INIT, "dyop_batch_options");
  BatchOptions options;
  options.thread_count = c.thread_count;
  options.stop = stop.get_token();
  if (c.progress) {
    options.progress = [c, &stop](std::size_t done, std::size_t total) {
      if (c.progress(c.user, done, total) != 0) stop.request_stop();
    };
  }
  return options;
}

dyop_distance_result distance_result(const DistanceResult& found) {
  return {sizeof(dyop_distance_result), int(found.status),
          to_c(static_cast<const WitnessPair&>(found))};
}

dyop_toi_result toi_result(const ToiResult& found) {
  dyop_toi_result result{};
  result.status = int(found.status);
  result.t_safe = found.t_safe;
  result.t_hit = found.t_hit.value_or(std::numeric_limits<double>::quiet_NaN());
  result.rounding_allowance = found.rounding_allowance;
  result.pose_a = to_c(found.X_WA);
  result.pose_b = to_c(found.X_WB);
  if (found.contact) {
    result.has_contact = 1;
    result.closing_speed = found.contact->closing_speed;
    result.witness = to_c(static_cast<const WitnessPair&>(*found.contact));
  }
  result.node_pairs = found.statistics.node_pairs;
  return result;
}

// Queries, and the shapes and motions kept alive while they run.
struct KeptShapes {
  const Shape* keep(std::shared_ptr<const Shape> shape) {
    return shapes.emplace_back(std::move(shape)).get();
  }
  const Motion* keep(std::shared_ptr<const Motion> motion) {
    return motions.emplace_back(std::move(motion)).get();
  }
  std::vector<std::shared_ptr<const Shape>> shapes;
  std::vector<std::shared_ptr<const Motion>> motions;
};

void run_distances(dyop_context& context, const dyop_distance_query* queries, std::size_t count,
                   const DistanceOptions& options, const BatchOptions& batch,
                   dyop_distance_result* results) {
  const auto in = sized_array(queries, count, "dyop_distance_query");
  auto out = sized_array(results, count, "dyop_distance_result");
  KeptShapes kept;
  std::vector<DistanceQuery> list;
  for (std::size_t i = 0; i < count; ++i) {
    const dyop_distance_query query = in.read(i);
    list.push_back({kept.keep(context.shape(query.a)), pose_from(query.pose_a),
                    kept.keep(context.shape(query.b)), pose_from(query.pose_b), options});
  }
  std::vector<DistanceResult> found(count);
  distance_batch(list, found, batch);
  for (std::size_t i = 0; i < count; ++i) out.write(i, distance_result(found[i]));
}

void run_impacts(dyop_context& context, const dyop_toi_query* queries, std::size_t count,
                 const ToiOptions& options, const BatchOptions& batch, dyop_toi_result* results) {
  const auto in = sized_array(queries, count, "dyop_toi_query");
  auto out = sized_array(results, count, "dyop_toi_result");
  KeptShapes kept;
  std::vector<ToiQuery> list;
  for (std::size_t i = 0; i < count; ++i) {
    const dyop_toi_query query = in.read(i);
    list.push_back({kept.keep(context.shape(query.a)), kept.keep(context.motion(query.motion_a)),
                    kept.keep(context.shape(query.b)), kept.keep(context.motion(query.motion_b)),
                    interval_from(query.interval), options});
  }
  std::vector<ToiResult> found(count);
  time_of_impact_batch(list, found, batch);
  for (std::size_t i = 0; i < count; ++i) out.write(i, toi_result(found[i]));
}

BatchOptions alone() {
  BatchOptions options;
  options.thread_count = 1;
  return options;
}

}  // namespace
}  // namespace dyop::c

using dyop::c::guard;

dyop_status dyop_compute_distance(dyop_context* context, const dyop_distance_query* query,
                                  const dyop_distance_options* options,
                                  dyop_distance_result* result) {
  return guard(context, [&] {
    dyop::c::run_distances(*context, query, 1, dyop::c::options_from(options), dyop::c::alone(),
                           result);
  });
}

dyop_status dyop_time_of_impact(dyop_context* context, const dyop_toi_query* query,
                                const dyop_toi_options* options, dyop_toi_result* result) {
  return guard(context, [&] {
    dyop::c::run_impacts(*context, query, 1, dyop::c::options_from(options), dyop::c::alone(),
                         result);
  });
}

dyop_status dyop_distance_batch(dyop_context* context, const dyop_distance_query* queries,
                                size_t count, const dyop_distance_options* options,
                                const dyop_batch_options* batch, dyop_distance_result* results) {
  return guard(context, [&] {
    std::stop_source stop;
    dyop::c::run_distances(*context, queries, count, dyop::c::options_from(options),
                           dyop::c::options_from(batch, stop), results);
  });
}

dyop_status dyop_time_of_impact_batch(dyop_context* context, const dyop_toi_query* queries,
                                      size_t count, const dyop_toi_options* options,
                                      const dyop_batch_options* batch, dyop_toi_result* results) {
  return guard(context, [&] {
    std::stop_source stop;
    dyop::c::run_impacts(*context, queries, count, dyop::c::options_from(options),
                         dyop::c::options_from(batch, stop), results);
  });
}
