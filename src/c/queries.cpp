// SPDX-License-Identifier: BSD-3-Clause
#include <stop_token>

#include "c/context.h"
#include "c/convert.h"
#include "dyop/chain/certify_chain.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/point_distance.h"
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

std::vector<Vector3> rows_from(const double* numbers, std::size_t count, const char* what) {
  DYOP_REQUIRE(numbers || count == 0, what, " must not be null");
  std::vector<Vector3> rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.emplace_back(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  }
  return rows;
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

dyop_obstacle handle_of(const std::optional<ObstacleId>& id) {
  return id ? numbered<dyop_obstacle>(*id) : dyop_obstacle{};
}

std::vector<Link> links_from(const dyop_context& context, const dyop_chain_link* links,
                             std::size_t count) {
  const auto in = sized_array(links, count, "dyop_chain_link");
  std::vector<Link> list;
  for (std::size_t i = 0; i < count; ++i) {
    const dyop_chain_link given = in.read(i);
    Link link;
    link.name = std::to_string(i);
    if (given.shape.generation != 0) link.shape = context.shape(given.shape);
    link.is_solid = given.is_solid != 0;
    link.groups = given.groups;
    list.push_back(std::move(link));
  }
  return list;
}

std::vector<Joint> joints_from(const dyop_chain_joint* joints, std::size_t count) {
  const auto in = sized_array(joints, count, "dyop_chain_joint");
  std::vector<Joint> list;
  for (std::size_t i = 0; i < count; ++i) {
    const dyop_chain_joint given = in.read(i);
    DYOP_REQUIRE(given.type >= DYOP_CHAIN_FIXED && given.type <= DYOP_CHAIN_PRISMATIC,
                 "type of joint ", i, " must be a dyop_chain_joint_type, not ", given.type);
    Joint joint;
    joint.name = std::to_string(i);
    joint.type = static_cast<JointType>(given.type);
    joint.parent = std::to_string(given.parent);
    joint.child = std::to_string(given.child);
    joint.X_PJ = pose_from(given.origin);
    joint.axis_J = vector_from(given.axis);
    list.push_back(std::move(joint));
  }
  return list;
}

JointPath path_from(std::int32_t kind, const double* times, const double* waypoints,
                    std::size_t waypoint_count, std::size_t coordinate_count) {
  DYOP_REQUIRE(kind == DYOP_PATH_LINEAR || kind == DYOP_PATH_CUBIC,
               "kind of a path must be DYOP_PATH_LINEAR or DYOP_PATH_CUBIC, not ", kind);
  DYOP_REQUIRE(times && waypoints, "times and waypoints must not be null");
  std::vector<JointVector> points;
  for (std::size_t i = 0; i < waypoint_count; ++i) {
    points.emplace_back(Eigen::Map<const JointVector>(waypoints + i * coordinate_count,
                                                      Eigen::Index(coordinate_count)));
  }
  const std::span<const Scalar> when(times, waypoint_count);
  return kind == DYOP_PATH_LINEAR ? JointPath::linear(when, points)
                                  : JointPath::cubic(when, points);
}

dyop_chain_result chain_result(const ChainResult& found) {
  dyop_chain_result result{};
  result.status = int(found.toi.status);
  result.t_safe = found.toi.t_safe;
  result.free_fraction = found.free_fraction;
  result.link_a = found.link_a ? std::int32_t(*found.link_a) : -1;
  result.link_b = found.link_b ? std::int32_t(*found.link_b) : -1;
  result.obstacle = handle_of(found.obstacle);
  if (found.toi.contact) {
    result.has_contact = 1;
    result.witness = to_c(static_cast<const WitnessPair&>(*found.toi.contact));
  }
  return result;
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
                           dyop::c::options_from(batch, stop), results);
  });
}

dyop_status dyop_time_of_impact_batch(dyop_context* context, const dyop_toi_query* queries,
                                      size_t count, const dyop_toi_options* options,
                                      const dyop_batch_options* batch, dyop_toi_result* results) {
  return guard(context, [&] {
    std::stop_source stop;
    dyop::c::run_impacts(*context, queries, count, dyop::c::toi_options_from(options),
                         dyop::c::options_from(batch, stop), results);
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
    const std::unique_lock lock(object->mutex);
    *obstacle = dyop::c::numbered<dyop_obstacle>(object->set.add(std::move(added)));
  });
}

dyop_status dyop_obstacle_move(dyop_context* context, dyop_obstacle_set set, dyop_obstacle obstacle,
                               dyop_motion motion) {
  return guard(context, [&] {
    const auto object = context->obstacle_set(set);
    const auto onto = context->motion(motion);
    const std::unique_lock lock(object->mutex);
    object->set.move(dyop::c::find_obstacle(object->set, obstacle), onto);
  });
}

dyop_status dyop_obstacle_remove(dyop_context* context, dyop_obstacle_set set,
                                 dyop_obstacle obstacle) {
  return guard(context, [&] {
    const auto object = context->obstacle_set(set);
    const std::unique_lock lock(object->mutex);
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
    const std::shared_lock lock(object->mutex);
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
    const std::shared_lock lock(object->mutex);
    const dyop::NearestObstacle found =
        object->set.nearest(*shape, dyop::c::pose_from(*require_given(pose, "pose")), t,
                            dyop::c::distance_options_from(options), filter);
    out.write(0, dyop::c::distance_result(found.distance));
    *obstacle = dyop::c::handle_of(found.obstacle);
  });
}

dyop_status dyop_chain_create(dyop_context* context, const dyop_chain_link* links,
                              size_t link_count, const dyop_chain_joint* joints, size_t joint_count,
                              dyop_chain* chain) {
  return guard(context, [&] {
    context->add<dyop::KinematicChain>(context->chains, chain,
                                       dyop::c::links_from(*context, links, link_count),
                                       dyop::c::joints_from(joints, joint_count));
  });
}

dyop_status dyop_chain_destroy(dyop_context* context, dyop_chain chain) {
  return guard(context, [&] { context->remove(context->chains, chain, "the chain"); });
}

dyop_status dyop_chain_poses(dyop_context* context, dyop_chain chain, const double* coordinates,
                             size_t coordinate_count, dyop_pose* poses, size_t link_count) {
  return guard(context, [&] {
    const auto object = context->chain(chain);
    DYOP_REQUIRE(coordinates || coordinate_count == 0, "coordinates must not be null");
    DYOP_REQUIRE(poses && link_count == object->links().size(), "poses must have room for ",
                 object->links().size(), " links, not ", link_count);
    const dyop::JointVector q =
        Eigen::Map<const dyop::JointVector>(coordinates, Eigen::Index(coordinate_count));
    const std::vector<dyop::RigidPose> found = object->link_poses(q);
    for (std::size_t i = 0; i < link_count; ++i) poses[i] = dyop::c::to_c(found[i]);
  });
}

dyop_status dyop_certify(dyop_context* context, dyop_chain chain, int32_t kind, const double* times,
                         const double* waypoints, size_t waypoint_count, size_t coordinate_count,
                         dyop_obstacle_set obstacles, const dyop_toi_options* options,
                         dyop_chain_result* result) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(result, 1, "dyop_chain_result");
    const auto links = context->chain(chain);
    const auto around = context->obstacle_set(obstacles);
    const dyop::JointPath path =
        dyop::c::path_from(kind, times, waypoints, waypoint_count, coordinate_count);
    dyop::ChainOptions chain_options;
    chain_options.toi = dyop::c::toi_options_from(options);
    const std::shared_lock lock(around->mutex);
    out.write(0, dyop::c::chain_result(dyop::certify(*links, path, around->set, chain_options)));
  });
}
