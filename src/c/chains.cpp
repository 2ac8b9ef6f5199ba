// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <stop_token>

#include "c/context.h"
#include "c/convert.h"
#include "dyop/chain/certify_chain.h"
#include "dyop/chain/link_pairs.h"

namespace dyop::c {
namespace {

static_assert(int(PairVerdict::Always) == DYOP_PAIR_ALWAYS);
static_assert(int(PairVerdict::Can) == DYOP_PAIR_CAN);
static_assert(int(PairVerdict::Undecided) == DYOP_PAIR_UNDECIDED);

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
    if (given.has_limits != 0) {
      joint.lower = given.lower;
      joint.upper = given.upper;
    }
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

std::vector<JointPath> paths_from(const dyop_context& context, const dyop_joint_path* paths,
                                  std::size_t count) {
  DYOP_REQUIRE(paths || count == 0, "paths must not be null");
  std::vector<JointPath> list;
  for (std::size_t i = 0; i < count; ++i) list.push_back(*context.joint_path(paths[i]));
  return list;
}

JointVector coordinates_from(const double* numbers, std::size_t count) {
  DYOP_REQUIRE(numbers || count == 0, "coordinates must not be null");
  return Eigen::Map<const JointVector>(numbers, Eigen::Index(count));
}

// Writes coordinates of which there must be as many as the caller says.
void write_coordinates(const JointVector& from, double* out, std::size_t count) {
  DYOP_REQUIRE(out || count == 0, "coordinates must not be null");
  DYOP_REQUIRE(std::size_t(from.size()) == count, "there are ", from.size(), " coordinates, not ",
               count);
  std::copy(from.begin(), from.end(), out);
}

void write_text(const std::string& from, char* text, std::size_t capacity) {
  DYOP_REQUIRE(text && capacity > 0, "text must have room for a character at least");
  const std::size_t length = std::min(capacity - 1, from.size());
  std::memcpy(text, from.data(), length);
  text[length] = '\0';
}

const Link& link_of(const Robot& robot, std::size_t link) {
  DYOP_REQUIRE(link < robot.chain->links().size(), "link ", link, " is not one of ",
               robot.chain->links().size());
  return robot.chain->links()[link];
}

LinkPairOptions pair_options_from(const dyop_link_pair_options* given) {
  const auto c = read_struct<dyop_link_pair_options>(given, DYOP_LINK_PAIR_OPTIONS_INIT,
                                                     "dyop_link_pair_options");
  LinkPairOptions options;
  options.samples = c.samples;
  options.max_boxes = c.max_boxes;
  if (c.seconds != 0) options.deadline = deadline_after(c.seconds);
  return options;
}

dyop_link_pair pair_record(const LinkPairReport& pair) {
  dyop_link_pair record{};
  record.verdict = int(pair.verdict);
  record.first = std::int32_t(pair.first);
  record.second = std::int32_t(pair.second);
  record.is_adjacent = pair.is_adjacent ? 1 : 0;
  record.has_witness = pair.witness ? 1 : 0;
  record.touching_share = pair.touching_share;
  record.undecided_share = pair.undecided_share;
  return record;
}

}  // namespace
}  // namespace dyop::c

using dyop::c::guard;
using dyop::c::require_given;

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
    const dyop::c::Reading reading(*around);
    out.write(0, dyop::c::chain_result(dyop::certify(*links, path, around->set, chain_options)));
  });
}

dyop_status dyop_joint_path_create(dyop_context* context, int32_t kind, const double* times,
                                   const double* waypoints, size_t waypoint_count,
                                   size_t coordinate_count, dyop_joint_path* path) {
  return guard(context, [&] {
    context->add<dyop::JointPath>(
        context->joint_paths, path,
        dyop::c::path_from(kind, times, waypoints, waypoint_count, coordinate_count));
  });
}

dyop_status dyop_joint_path_destroy(dyop_context* context, dyop_joint_path path) {
  return guard(context, [&] { context->remove(context->joint_paths, path, "the joint path"); });
}

dyop_status dyop_joint_path_domain(dyop_context* context, dyop_joint_path path,
                                   dyop_interval* domain, size_t* coordinate_count) {
  return guard(context, [&] {
    const auto object = context->joint_path(path);
    require_given(coordinate_count, "coordinate_count");
    *require_given(domain, "domain") = {object->domain().begin, object->domain().end};
    *coordinate_count = object->coordinate_count();
  });
}

dyop_status dyop_joint_path_position(dyop_context* context, dyop_joint_path path, double t,
                                     double* coordinates, size_t coordinate_count) {
  return guard(context, [&] {
    dyop::c::write_coordinates(context->joint_path(path)->position(t), coordinates,
                               coordinate_count);
  });
}

dyop_status dyop_certify_batch(dyop_context* context, dyop_chain chain,
                               const dyop_joint_path* paths, size_t path_count,
                               dyop_obstacle_set obstacles, uint32_t groups,
                               int32_t with_self_collision, const dyop_toi_options* options,
                               const dyop_batch_options* batch, dyop_chain_result* results) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(results, path_count, "dyop_chain_result");
    const auto links = context->chain(chain);
    const auto around = context->obstacle_set(obstacles);
    const std::vector<dyop::JointPath> list = dyop::c::paths_from(*context, paths, path_count);
    dyop::ChainOptions chain_options;
    chain_options.toi = dyop::c::toi_options_from(options);
    chain_options.obstacles.groups = groups;
    chain_options.with_self_collision = with_self_collision != 0;
    std::stop_source stop;
    std::vector<dyop::ChainResult> found(path_count);
    const dyop::c::Reading reading(*around);
    dyop::BatchOptions batch_options = dyop::c::batch_options_from(batch, stop);
    if (batch_options.progress) {
      batch_options.progress = [&, told = std::move(batch_options.progress)](std::size_t done,
                                                                             std::size_t total) {
        const dyop::c::Reading also_in_this_thread(*around, false);
        told(done, total);
      };
    }
    dyop::certify_batch(*links, list, around->set, found, chain_options, batch_options);
    for (std::size_t i = 0; i < path_count; ++i) out.write(i, dyop::c::chain_result(found[i]));
  });
}

dyop_status dyop_robot_create(dyop_context* context, dyop_chain chain, dyop_robot* robot) {
  return guard(context, [&] {
    context->add<dyop::Robot>(context->robots, robot,
                              dyop::make_robot("robot", *context->chain(chain)));
  });
}

dyop_status dyop_robot_destroy(dyop_context* context, dyop_robot robot) {
  return guard(context, [&] { context->remove(context->robots, robot, "the robot"); });
}

dyop_status dyop_robot_chain(dyop_context* context, dyop_robot robot, dyop_chain* chain) {
  return guard(context,
               [&] { context->adopt(context->chains, chain, context->robot(robot)->chain); });
}

dyop_status dyop_robot_describe(dyop_context* context, dyop_robot robot, dyop_robot_info* info) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(info, 1, "dyop_robot_info");
    const auto object = context->robot(robot);
    dyop_robot_info found{};
    found.link_count = object->chain->links().size();
    found.coordinate_count = object->chain->coordinate_count();
    found.free_count = object->free_count();
    out.write(0, found);
  });
}

dyop_status dyop_robot_link_name(dyop_context* context, dyop_robot robot, size_t link, char* text,
                                 size_t capacity) {
  return guard(context, [&] {
    dyop::c::write_text(dyop::c::link_of(*context->robot(robot), link).name, text, capacity);
  });
}

dyop_status dyop_robot_joint_name(dyop_context* context, dyop_robot robot, size_t free_coordinate,
                                  char* text, size_t capacity) {
  return guard(context, [&] {
    const auto object = context->robot(robot);
    DYOP_REQUIRE(free_coordinate < object->free_count(), "free coordinate ", free_coordinate,
                 " is not one of ", object->free_count());
    dyop::c::write_text(object->chain->joints()[object->free_joints[free_coordinate]].name, text,
                        capacity);
  });
}

dyop_status dyop_robot_limits(dyop_context* context, dyop_robot robot, double* lower, double* upper,
                              size_t free_count) {
  return guard(context, [&] {
    const auto object = context->robot(robot);
    DYOP_REQUIRE(free_count == object->free_count(), "there are ", object->free_count(),
                 " free coordinates, not ", free_count);
    DYOP_REQUIRE((lower && upper) || free_count == 0, "lower and upper must not be null");
    const auto count = Eigen::Index(free_count);
    Eigen::Map<dyop::JointVector>(lower, count) = object->lower();
    Eigen::Map<dyop::JointVector>(upper, count) = object->upper();
  });
}

dyop_status dyop_robot_expand(dyop_context* context, dyop_robot robot,
                              const double* free_coordinates, size_t free_count,
                              double* coordinates, size_t coordinate_count) {
  return guard(context, [&] {
    dyop::c::write_coordinates(
        context->robot(robot)->expand(dyop::c::coordinates_from(free_coordinates, free_count)),
        coordinates, coordinate_count);
  });
}

dyop_status dyop_robot_expand_path(dyop_context* context, dyop_robot robot,
                                   dyop_joint_path free_path, dyop_joint_path* path) {
  return guard(context, [&] {
    context->add<dyop::JointPath>(context->joint_paths, path,
                                  context->robot(robot)->expand(*context->joint_path(free_path)));
  });
}

dyop_status dyop_robot_attach(dyop_context* context, dyop_robot robot, const char* name,
                              dyop_shape shape, size_t link, const dyop_pose* pose,
                              const size_t* touch_links, size_t touch_count, dyop_robot* holding) {
  return guard(context, [&] {
    const auto object = context->robot(robot);
    DYOP_REQUIRE(touch_links || touch_count == 0, "touch_links must not be null");
    std::vector<std::string> touched;
    for (std::size_t i = 0; i < touch_count; ++i) {
      touched.push_back(dyop::c::link_of(*object, touch_links[i]).name);
    }
    dyop::Link held;
    held.name = require_given(name, "name");
    held.shape = context->shape(shape);
    context->add<dyop::Robot>(
        context->robots, holding,
        dyop::attach(*object, std::move(held), dyop::c::link_of(*object, link).name,
                     dyop::c::pose_from(*require_given(pose, "pose")), touched));
  });
}

dyop_status dyop_decide_link_pairs(dyop_context* context, dyop_robot robot,
                                   const dyop_link_pair_options* options, dyop_link_pair* pairs,
                                   size_t capacity, size_t* count, double* witnesses) {
  return guard(context, [&] {
    const auto object = context->robot(robot);
    const std::vector<dyop::LinkPairReport> found =
        dyop::decide_link_pairs(*object, dyop::c::pair_options_from(options));
    std::vector<dyop_link_pair> records;
    for (const dyop::LinkPairReport& pair : found) records.push_back(dyop::c::pair_record(pair));
    dyop::c::hand_over(records, pairs, capacity, count, "dyop_link_pair");
    for (std::size_t i = 0; witnesses && i < std::min(capacity, found.size()); ++i) {
      double* const row = witnesses + i * object->free_count();
      std::fill(row, row + object->free_count(), 0.0);
      if (found[i].witness) std::copy(found[i].witness->begin(), found[i].witness->end(), row);
    }
  });
}
