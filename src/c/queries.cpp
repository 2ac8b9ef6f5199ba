// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <functional>
#include <stop_token>

#include "c/context.h"
#include "c/convert.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/point_distance.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::c {
namespace {

// The enumerators of C match those of C++, in the same order.
static_assert(int(DistanceStatus::Inconclusive) == DYOP_DISTANCE_INCONCLUSIVE);
static_assert(int(DistanceStatus::FartherThanMaxDistance) == DYOP_DISTANCE_FARTHER_THAN_MAX);
static_assert(int(DistanceStatus::Overlapping) == DYOP_DISTANCE_OVERLAPPING);
static_assert(int(ToiStatus::NumericalLimit) == DYOP_TOI_NUMERICAL_LIMIT);
static_assert(int(ToiStatus::InitiallyWithinTarget) == DYOP_TOI_INITIALLY_WITHIN_TARGET);
static_assert(int(ToiStatus::Impact) == DYOP_TOI_IMPACT);

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

dyop_point_result point_result(const PointDistance& found) {
  dyop_point_result result{};
  result.triangle = found.triangle.value_or(-1);
  result.lower = found.lower;
  result.upper = found.upper;
  write_vector(found.p_WC, result.point);
  write_vector(found.nhat_W, result.normal);
  return result;
}

// The obstacle of a handle, which must be in the set.
ObstacleId find_obstacle(const ObstacleSet& set, dyop_obstacle obstacle) {
  const auto id = ObstacleId(obstacle.number - 1);
  if (obstacle.number == 0 || !set.contains(id)) {
    throw StaleHandle(core_internal::compose_message("obstacle ", obstacle.number, " is stale"));
  }
  return id;
}

const TriangleMesh& mesh_of(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  DYOP_REQUIRE(mesh, "b must be a mesh: a deforming mesh meets no other shapes");
  return *mesh;
}

BatchOptions alone() {
  BatchOptions options;
  options.thread_count = 1;
  return options;
}

}  // namespace
}  // namespace dyop::c

using dyop::c::guard;
using dyop::c::require_given;

dyop_status dyop_compute_distance(dyop_context* context, const dyop_distance_query* query,
                                  const dyop_distance_options* options,
                                  dyop_distance_result* result) {
  return guard(context, [&] {
    dyop::c::run_distances(*context, query, 1, dyop::c::distance_options_from(options),
                           dyop::c::alone(), result);
  });
}

dyop_status dyop_time_of_impact(dyop_context* context, const dyop_toi_query* query,
                                const dyop_toi_options* options, dyop_toi_result* result) {
  return guard(context, [&] {
    dyop::c::run_impacts(*context, query, 1, dyop::c::toi_options_from(options), dyop::c::alone(),
                         result);
  });
}

dyop_status dyop_time_of_impact_within(dyop_context* context, const dyop_toi_query* query,
                                       const dyop_toi_options* options, double seconds,
                                       dyop_toi_result* result) {
  return guard(context, [&] {
    dyop::ToiOptions limited = dyop::c::toi_options_from(options);
    limited.deadline = dyop::c::deadline_after(seconds);
    dyop::c::run_impacts(*context, query, 1, limited, dyop::c::alone(), result);
  });
}

dyop_status dyop_find_contacts(dyop_context* context, const dyop_distance_query* query,
                               double max_distance, dyop_witness* contacts, size_t capacity,
                               size_t* count) {
  return guard(context, [&] {
    const dyop_distance_query given = dyop::c::sized_array(query, 1, "dyop_distance_query").read(0);
    DYOP_REQUIRE(contacts || capacity == 0, "contacts must not be null");
    const std::vector<dyop::Contact> found = dyop::find_contacts(
        *context->shape(given.a), dyop::c::pose_from(given.pose_a), *context->shape(given.b),
        dyop::c::pose_from(given.pose_b), max_distance);
    for (std::size_t i = 0; i < std::min(capacity, found.size()); ++i) {
      contacts[i] = dyop::c::to_c(static_cast<const dyop::WitnessPair&>(found[i]));
    }
    *require_given(count, "count") = found.size();
  });
}

dyop_status dyop_point_distance(dyop_context* context, dyop_shape shape, const dyop_pose* pose,
                                int32_t is_signed, const double* points, size_t count,
                                dyop_point_result* results) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(results, count, "dyop_point_result");
    dyop::PointDistanceOptions options;
    options.is_signed = is_signed != 0;
    std::vector<dyop::PointDistance> found(count);
    dyop::point_distance_batch(*context->shape(shape),
                               dyop::c::pose_from(*require_given(pose, "pose")),
                               dyop::c::rows_from(points, count, "points"), found, options);
    for (std::size_t i = 0; i < count; ++i) out.write(i, dyop::c::point_result(found[i]));
  });
}

dyop_status dyop_distance_batch(dyop_context* context, const dyop_distance_query* queries,
                                size_t count, const dyop_distance_options* options,
                                const dyop_batch_options* batch, dyop_distance_result* results) {
  return guard(context, [&] {
    std::stop_source stop;
    dyop::c::run_distances(*context, queries, count, dyop::c::distance_options_from(options),
                           dyop::c::batch_options_from(batch, stop), results);
  });
}

dyop_status dyop_time_of_impact_batch(dyop_context* context, const dyop_toi_query* queries,
                                      size_t count, const dyop_toi_options* options,
                                      const dyop_batch_options* batch, dyop_toi_result* results) {
  return guard(context, [&] {
    std::stop_source stop;
    dyop::c::run_impacts(*context, queries, count, dyop::c::toi_options_from(options),
                         dyop::c::batch_options_from(batch, stop), results);
  });
}

dyop_status dyop_obstacle_set_create(dyop_context* context, dyop_obstacle_set* set) {
  return guard(context,
               [&] { context->add<dyop::c::ObstacleObject>(context->obstacle_sets, set); });
}

dyop_status dyop_obstacle_set_destroy(dyop_context* context, dyop_obstacle_set set) {
  return guard(context, [&] { context->remove(context->obstacle_sets, set, "the obstacle set"); });
}

dyop_status dyop_obstacle_add(dyop_context* context, dyop_obstacle_set set, dyop_shape shape,
                              dyop_motion motion, uint32_t groups, int32_t is_solid,
                              dyop_obstacle* obstacle) {
  return guard(context, [&] {
    require_given(obstacle, "obstacle");
    const auto object = context->obstacle_set(set);
    dyop::Obstacle added{context->shape(shape), context->motion(motion), groups, is_solid != 0};
    const auto lock = dyop::c::Reading::change(*object);
    *obstacle = dyop::c::numbered<dyop_obstacle>(object->set.add(std::move(added)));
  });
}

dyop_status dyop_obstacle_move(dyop_context* context, dyop_obstacle_set set, dyop_obstacle obstacle,
                               dyop_motion motion) {
  return guard(context, [&] {
    const auto object = context->obstacle_set(set);
    const auto onto = context->motion(motion);
    const auto lock = dyop::c::Reading::change(*object);
    object->set.move(dyop::c::find_obstacle(object->set, obstacle), onto);
  });
}

dyop_status dyop_obstacle_remove(dyop_context* context, dyop_obstacle_set set,
                                 dyop_obstacle obstacle) {
  return guard(context, [&] {
    const auto object = context->obstacle_set(set);
    const auto lock = dyop::c::Reading::change(*object);
    object->set.remove(dyop::c::find_obstacle(object->set, obstacle));
  });
}

dyop_status dyop_first_impact(dyop_context* context, dyop_obstacle_set set, dyop_shape body,
                              dyop_motion motion, dyop_interval interval, uint32_t groups,
                              const dyop_toi_options* options, dyop_toi_result* result,
                              dyop_obstacle* obstacle) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_toi_result");
    require_given(obstacle, "obstacle");
    const auto object = context->obstacle_set(set);
    const auto shape = context->shape(body);
    const auto path = context->motion(motion);
    dyop::ObstacleFilter filter;
    filter.groups = groups;
    const dyop::c::Reading reading(*object);
    const dyop::ObstacleImpact found =
        object->set.first_impact(*shape, *path, dyop::c::interval_from(interval),
                                 dyop::c::toi_options_from(options), filter);
    out.write(0, dyop::c::toi_result(found.toi));
    *obstacle = dyop::c::handle_of(found.obstacle);
  });
}

dyop_status dyop_nearest_obstacle(dyop_context* context, dyop_obstacle_set set, dyop_shape body,
                                  const dyop_pose* pose, double t, uint32_t groups,
                                  const dyop_distance_options* options,
                                  dyop_distance_result* result, dyop_obstacle* obstacle) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_distance_result");
    require_given(obstacle, "obstacle");
    const auto object = context->obstacle_set(set);
    const auto shape = context->shape(body);
    dyop::ObstacleFilter filter;
    filter.groups = groups;
    const dyop::c::Reading reading(*object);
    const dyop::NearestObstacle found =
        object->set.nearest(*shape, dyop::c::pose_from(*require_given(pose, "pose")), t,
                            dyop::c::distance_options_from(options), filter);
    out.write(0, dyop::c::distance_result(found.distance));
    *obstacle = dyop::c::handle_of(found.obstacle);
  });
}

dyop_status dyop_deforming_mesh_create(dyop_context* context, const double* begin,
                                       const double* end, size_t vertex_count,
                                       const int32_t* triangles, size_t triangle_count,
                                       dyop_deforming_mesh* mesh) {
  return guard(context, [&] {
    context->add<dyop::c::DeformingObject>(
        context->deforming_meshes, mesh,
        dyop::DeformingMesh(dyop::c::rows_from(begin, vertex_count, "begin"),
                            dyop::c::rows_from(end, vertex_count, "end"),
                            dyop::c::triangles_from(triangles, triangle_count)));
  });
}

dyop_status dyop_deforming_mesh_refit(dyop_context* context, dyop_deforming_mesh mesh,
                                      const double* begin, const double* end, size_t vertex_count) {
  return guard(context, [&] {
    const auto object = context->deforming_mesh(mesh);
    const auto from = dyop::c::rows_from(begin, vertex_count, "begin");
    const auto to = dyop::c::rows_from(end, vertex_count, "end");
    const auto lock = dyop::c::Reading::change(*object);
    object->mesh.refit(from, to);
  });
}

dyop_status dyop_deforming_mesh_destroy(dyop_context* context, dyop_deforming_mesh mesh) {
  return guard(context,
               [&] { context->remove(context->deforming_meshes, mesh, "the deforming mesh"); });
}

dyop_status dyop_deforming_time_of_impact(dyop_context* context, dyop_deforming_mesh a,
                                          dyop_shape b, dyop_motion motion_b,
                                          dyop_interval interval, const dyop_toi_options* options,
                                          dyop_toi_result* result) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_toi_result");
    const auto object = context->deforming_mesh(a);
    const auto shape = context->shape(b);
    const auto motion = context->motion(motion_b);
    const dyop::c::Reading reading(*object);
    out.write(0, dyop::c::toi_result(dyop::time_of_impact(object->mesh, dyop::c::mesh_of(*shape),
                                                          *motion, dyop::c::interval_from(interval),
                                                          dyop::c::toi_options_from(options))));
  });
}

dyop_status dyop_deforming_pair_time_of_impact(dyop_context* context, dyop_deforming_mesh a,
                                               dyop_deforming_mesh b, dyop_interval interval,
                                               const dyop_toi_options* options,
                                               dyop_toi_result* result) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_toi_result");
    const auto first = context->deforming_mesh(a);
    const auto second = context->deforming_mesh(b);
    // By address, so that two calls never wait for each other; one object once.
    const auto [one, other] = std::minmax({first.get(), second.get()}, std::less<>());
    const dyop::c::Reading reading(*one);
    const dyop::c::Reading reading_other(*other, one != other);
    out.write(0, dyop::c::toi_result(dyop::time_of_impact(first->mesh, second->mesh,
                                                          dyop::c::interval_from(interval),
                                                          dyop::c::toi_options_from(options))));
  });
}

dyop_status dyop_deforming_distance(dyop_context* context, dyop_deforming_mesh a, double fraction,
                                    dyop_shape b, const dyop_pose* pose_b, double max_distance,
                                    dyop_distance_result* result) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_distance_result");
    const auto object = context->deforming_mesh(a);
    const auto shape = context->shape(b);
    dyop::DistanceOptions options;
    options.max_distance = max_distance;
    dyop::DistanceCache cache;
    const dyop::c::Reading reading(*object);
    out.write(0, dyop::c::distance_result(dyop::distance(
                     object->mesh, fraction, dyop::c::mesh_of(*shape),
                     dyop::c::pose_from(*require_given(pose_b, "pose_b")), options, cache)));
  });
}
