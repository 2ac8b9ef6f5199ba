// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>

#include "c/context.h"
#include "c/convert.h"

namespace dyop::c {
namespace {

static_assert(int(ObstacleRole::HardRegion) == DYOP_HARD_REGION);
static_assert(int(ObstacleRole::SoftRegion) == DYOP_SOFT_REGION);
static_assert(int(ObstacleRole::Monitor) == DYOP_MONITOR);
static_assert(int(HapticStatus::Deadline) == DYOP_HAPTIC_DEADLINE);
static_assert(int(HapticStatus::Overlapping) == DYOP_HAPTIC_OVERLAPPING);
static_assert(int(HapticStatus::Outlier) == DYOP_HAPTIC_OUTLIER);
static_assert(int(ContactState::Stick) == DYOP_TOOL_CONTACT_STICK);
static_assert(int(ContactState::Slip) == DYOP_TOOL_CONTACT_SLIP);
static_assert(sizeof(dyop_device_pose::angles) == kMostHinges * sizeof(double));

ToolObstacle obstacle_from(const dyop_context& context, const dyop_tool_obstacle& c,
                           std::size_t number) {
  DYOP_REQUIRE(c.role >= DYOP_TISSUE && c.role <= DYOP_MONITOR, "role of obstacle ", number,
               " must be a dyop_obstacle_role, not ", c.role);
  ToolObstacle obstacle;
  obstacle.name = std::to_string(number);
  obstacle.role = static_cast<ObstacleRole>(c.role);
  obstacle.margin = c.margin;
  obstacle.friction = c.friction;
  obstacle.soft_stiffness = c.soft_stiffness;
  const std::shared_ptr<const Shape> shape = context.shape(c.shape);
  const RigidPose X_WO = pose_from(c.pose);
  if (c.is_deforming == 0) {
    obstacle.shape = shape;
    obstacle.X_WO = X_WO;
    return obstacle;
  }
  const auto* mesh = dynamic_cast<const TriangleMesh*>(shape.get());
  DYOP_REQUIRE(mesh, "obstacle ", number, " deforms, so its shape must be a mesh");
  for (const Vector3& vertex : mesh->vertices()) obstacle.vertices.push_back(X_WO * vertex);
  obstacle.triangles.assign(mesh->triangles().begin(), mesh->triangles().end());
  return obstacle;
}

ToolPart part_from(const dyop_context& context, const dyop_tool_part& c) {
  ToolPart part{context.shape(c.shape), pose_from(c.pose), {}};
  if (c.hinge >= 0) part.hinge = std::size_t(c.hinge);
  return part;
}

CouplingOptions coupling_from(const dyop_coupling& c) {
  CouplingOptions coupling;
  coupling.stiffness = vector_from(c.stiffness);
  coupling.damping = vector_from(c.damping);
  coupling.rotational_stiffness = vector_from(c.rotational_stiffness);
  coupling.rotational_damping = vector_from(c.rotational_damping);
  coupling.largest_force = c.largest_force;
  coupling.largest_torque = c.largest_torque;
  coupling.device_damping = c.device_damping;
  coupling.device_rotational_damping = c.device_rotational_damping;
  coupling.period = c.period;
  coupling.bounds_energy = c.bounds_energy != 0;
  return coupling;
}

HapticOptions haptic_options_from(const dyop_haptic_options& c) {
  HapticOptions options;
  options.coupling = coupling_from(c.coupling);
  options.rest_offset = c.rest_offset;
  options.recovery_speed = c.recovery_speed;
  options.max_rounds = c.max_rounds;
  options.max_attempts = c.max_attempts;
  options.max_contacts = c.max_contacts;
  options.clearance_tolerance = c.clearance_tolerance;
  options.clearance_work = c.clearance_work;
  options.max_work = c.max_work;
  options.largest_device_speed = c.largest_device_speed;
  return options;
}

ToolPose tool_from(const dyop_device_pose& c) {
  ToolPose tool{pose_from(c.pose), {}};
  std::copy(std::begin(c.angles), std::end(c.angles), tool.angles.begin());
  return tool;
}

// As it comes from the device: the session checks it.
DevicePose device_from(const dyop_device_pose& c) {
  const double* q = c.pose.rotation;
  DevicePose device;
  device.p_WD = vector_from(c.pose.position);
  device.q_WD = Quaternion(q[0], q[1], q[2], q[3]);
  std::copy(std::begin(c.angles), std::end(c.angles), device.angles.begin());
  return device;
}

dyop_haptic_tick tick_record(const HapticTick& tick) {
  dyop_haptic_tick record{};
  record.status = int(tick.status);
  record.tool = to_c(tick.tool.X_WT);
  std::copy(tick.tool.angles.begin(), tick.tool.angles.end(), record.angles);
  write_vector(tick.wrench.force_W, record.force);
  write_vector(tick.wrench.torque_W, record.torque);
  record.energy_returned = tick.energy_returned;
  record.tissue_stopped = tick.tissue_stopped;
  record.tissue_lag = tick.tissue_lag;
  record.time = tick.time;
  record.latency = std::chrono::duration<double>(tick.latency).count();
  return record;
}

// Where a point lies on a deforming mesh: in any struct with these fields.
template <typename Record>
void write_surface(const std::optional<SurfacePoint>& surface, Record& record) {
  record.triangle = surface ? surface->triangle : -1;
  if (surface) std::copy(surface->weights.begin(), surface->weights.end(), record.weights);
}

dyop_tool_contact contact_record(const ToolContactPoint& contact) {
  dyop_tool_contact record{};
  record.obstacle = std::int32_t(contact.obstacle);
  record.part = std::int32_t(contact.part);
  record.state = int(contact.state);
  write_vector(contact.p_W, record.point);
  write_vector(contact.nhat_W, record.normal);
  record.gap = contact.gap;
  write_vector(contact.force_W, record.force);
  write_vector(contact.p_WO, record.obstacle_point);
  write_surface(contact.surface, record);
  return record;
}

dyop_tool_impulse impulse_record(const ToolImpulse& impulse) {
  dyop_tool_impulse record{};
  record.obstacle = std::int32_t(impulse.obstacle);
  write_vector(impulse.p_WO, record.obstacle_point);
  write_vector(impulse.impulse_W, record.impulse);
  write_surface(impulse.surface, record);
  return record;
}

dyop_tool_clearance clearance_record(const ToolClearance& clearance) {
  dyop_tool_clearance record{};
  record.is_breached = clearance.is_breached ? 1 : 0;
  record.lower = clearance.lower;
  record.upper = clearance.upper;
  write_vector(clearance.p_WT, record.tool_point);
  write_vector(clearance.p_WO, record.obstacle_point);
  record.time_to_breach = clearance.time_to_breach;
  return record;
}

ToolHinge hinge_from(const dyop_tool_hinge& c) {
  return {pose_from(c.pose), c.angle, c.stiffness};
}

// Of the options or of a tool.
template <typename Struct>
std::optional<ToolTrocar> trocar_from(const Struct& c) {
  if (c.has_trocar == 0) return std::nullopt;
  return ToolTrocar{vector_from(c.trocar_point), vector_from(c.shaft_point),
                    vector_from(c.shaft_axis)};
}

using PartList = SizedArray<dyop_tool_part, const std::byte>;
using HingeList = SizedArray<dyop_tool_hinge, const std::byte>;

// Those of a tool among the parts and hinges of all, from the first that are left.
HapticTool tool_from(const dyop_context& context, const dyop_haptic_tool& c, const PartList& parts,
                     std::size_t& first_part, const HingeList& hinges, std::size_t& first_hinge) {
  HapticTool tool;
  for (std::uint64_t k = 0; k < c.part_count; ++k) {
    tool.parts.push_back(part_from(context, parts.read(first_part++)));
  }
  for (std::uint64_t k = 0; k < c.hinge_count; ++k) {
    tool.hinges.push_back(hinge_from(hinges.read(first_hinge++)));
  }
  tool.X_WT = pose_from(c.start);
  tool.trocar = trocar_from(c);
  if (c.has_coupling != 0) tool.coupling = coupling_from(c.coupling);
  return tool;
}

void add_obstacles(const dyop_context& context, const dyop_tool_obstacle* obstacles,
                   std::size_t count, HapticScene& scene) {
  const auto list = sized_array(obstacles, count, "dyop_tool_obstacle");
  for (std::size_t i = 0; i < count; ++i) {
    scene.obstacles.push_back(obstacle_from(context, list.read(i), i));
  }
}

HapticSession::Deadline haptic_deadline(double seconds) {
  HapticSession::Deadline deadline;
  if (seconds != 0) deadline = deadline_after(seconds);
  return deadline;
}

// The list of a tool's last tick, each entry as `record` writes it.
template <typename Entry, typename Struct>
dyop_status hand_over_last(dyop_context* context, dyop_haptic_session session, std::size_t tool,
                           std::vector<Entry> HapticTick::*list, Struct (*record)(const Entry&),
                           Struct* out, std::size_t capacity, std::size_t* count,
                           const char* what) {
  return guard(context, [&] {
    std::vector<Struct> records;
    const auto object = context->haptic_session(session);
    for (const Entry& entry : object->last(tool).*list) records.push_back(record(entry));
    hand_over(records, out, capacity, count, what);
  });
}

}  // namespace
}  // namespace dyop::c

using dyop::c::guard;
using dyop::c::require_given;

dyop_status dyop_haptic_session_create(dyop_context* context, const dyop_tool_part* parts,
                                       size_t part_count, const dyop_tool_hinge* hinges,
                                       size_t hinge_count, const dyop_tool_obstacle* obstacles,
                                       size_t obstacle_count, const dyop_pose* start,
                                       const dyop_haptic_options* options,
                                       dyop_haptic_session* session) {
  return guard(context, [&] {
    const auto part_list = dyop::c::sized_array(parts, part_count, "dyop_tool_part");
    const auto hinge_list = dyop::c::sized_array(hinges, hinge_count, "dyop_tool_hinge");
    const auto given = dyop::c::read_struct<dyop_haptic_options>(options, DYOP_HAPTIC_OPTIONS_INIT,
                                                                 "dyop_haptic_options");
    dyop::HapticScene scene;
    for (std::size_t i = 0; i < part_count; ++i) {
      scene.tool.push_back(dyop::c::part_from(*context, part_list.read(i)));
    }
    for (std::size_t i = 0; i < hinge_count; ++i) {
      scene.hinges.push_back(dyop::c::hinge_from(hinge_list.read(i)));
    }
    dyop::c::add_obstacles(*context, obstacles, obstacle_count, scene);
    scene.X_WT = dyop::c::pose_from(*require_given(start, "start"));
    scene.trocar = dyop::c::trocar_from(given);
    context->add<dyop::HapticSession>(context->haptic_sessions, session, scene,
                                      dyop::c::haptic_options_from(given));
  });
}

dyop_status dyop_haptic_session_create_tools(
    dyop_context* context, const dyop_haptic_tool* tools, size_t tool_count,
    const dyop_tool_part* parts, size_t part_count, const dyop_tool_hinge* hinges,
    size_t hinge_count, const dyop_tool_obstacle* obstacles, size_t obstacle_count,
    double tool_margin, double tool_friction, const dyop_haptic_options* options,
    dyop_haptic_session* session) {
  return guard(context, [&] {
    const auto tool_list = dyop::c::sized_array(tools, tool_count, "dyop_haptic_tool");
    const auto part_list = dyop::c::sized_array(parts, part_count, "dyop_tool_part");
    const auto hinge_list = dyop::c::sized_array(hinges, hinge_count, "dyop_tool_hinge");
    const auto given = dyop::c::read_struct<dyop_haptic_options>(options, DYOP_HAPTIC_OPTIONS_INIT,
                                                                 "dyop_haptic_options");
    DYOP_REQUIRE(tool_count > 0, "there must be at least one tool");
    DYOP_REQUIRE(given.has_trocar == 0, "several tools have trocars of their own, not the options");
    dyop::HapticScene scene;
    std::size_t part = 0, hinge = 0;
    for (std::size_t i = 0; i < tool_count; ++i) {
      const dyop_haptic_tool c = tool_list.read(i);
      DYOP_REQUIRE(c.part_count <= part_count - part && c.hinge_count <= hinge_count - hinge,
                   "tool ", i, " has ", c.part_count, " parts and ", c.hinge_count, " hinges, but ",
                   part_count - part, " and ", hinge_count - hinge, " are left");
      scene.more_tools.push_back(
          dyop::c::tool_from(*context, c, part_list, part, hinge_list, hinge));
    }
    DYOP_REQUIRE(part == part_count && hinge == hinge_count, part_count - part, " parts and ",
                 hinge_count - hinge, " hinges are of no tool");
    dyop::HapticOptions settings = dyop::c::haptic_options_from(given);
    // The first one is the scene's own.
    dyop::HapticTool& first = scene.more_tools.front();
    const dyop::CouplingOptions others = settings.coupling;
    for (dyop::HapticTool& tool : scene.more_tools) {
      if (!tool.coupling) tool.coupling = others;
    }
    settings.coupling = *first.coupling;
    scene.tool = std::move(first.parts);
    scene.hinges = std::move(first.hinges);
    scene.X_WT = first.X_WT;
    scene.trocar = first.trocar;
    scene.more_tools.erase(scene.more_tools.begin());
    scene.tool_margin = tool_margin;
    scene.tool_friction = tool_friction;
    dyop::c::add_obstacles(*context, obstacles, obstacle_count, scene);
    context->add<dyop::HapticSession>(context->haptic_sessions, session, scene, settings);
  });
}

dyop_status dyop_haptic_update_tools(dyop_context* context, dyop_haptic_session session,
                                     const dyop_device_pose* devices, size_t device_count,
                                     double dt, double seconds, dyop_haptic_tick* ticks) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(ticks, device_count, "dyop_haptic_tick");
    const auto object = context->haptic_session(session);
    if (device_count > 0) require_given(devices, "devices");
    std::vector<dyop::DevicePose> poses;
    for (std::size_t k = 0; k < device_count; ++k) {
      poses.push_back(dyop::c::device_from(devices[k]));
    }
    const auto results = object->update(poses, dt, dyop::c::haptic_deadline(seconds));
    for (std::size_t k = 0; k < results.size(); ++k) {
      out.write(k, dyop::c::tick_record(results[k]));
    }
  });
}

dyop_status dyop_haptic_contacts_of(dyop_context* context, dyop_haptic_session session, size_t tool,
                                    dyop_tool_contact* contacts, size_t capacity, size_t* count) {
  return dyop::c::hand_over_last(context, session, tool, &dyop::HapticTick::contacts,
                                 dyop::c::contact_record, contacts, capacity, count,
                                 "dyop_tool_contact");
}

dyop_status dyop_haptic_impulses_of(dyop_context* context, dyop_haptic_session session, size_t tool,
                                    dyop_tool_impulse* impulses, size_t capacity, size_t* count) {
  return dyop::c::hand_over_last(context, session, tool, &dyop::HapticTick::impulses,
                                 dyop::c::impulse_record, impulses, capacity, count,
                                 "dyop_tool_impulse");
}

dyop_status dyop_haptic_clearances_of(dyop_context* context, dyop_haptic_session session,
                                      size_t tool, dyop_tool_clearance* clearances, size_t capacity,
                                      size_t* count) {
  return dyop::c::hand_over_last(context, session, tool, &dyop::HapticTick::clearances,
                                 dyop::c::clearance_record, clearances, capacity, count,
                                 "dyop_tool_clearance");
}

dyop_status dyop_haptic_tool_contacts(dyop_context* context, dyop_haptic_session session,
                                      size_t tool, dyop_tool_contact* contacts, size_t capacity,
                                      size_t* count) {
  return dyop::c::hand_over_last(context, session, tool, &dyop::HapticTick::tool_contacts,
                                 dyop::c::contact_record, contacts, capacity, count,
                                 "dyop_tool_contact");
}

dyop_status dyop_haptic_tool_clearances(dyop_context* context, dyop_haptic_session session,
                                        size_t tool, dyop_tool_clearance* clearances,
                                        size_t capacity, size_t* count) {
  return dyop::c::hand_over_last(context, session, tool, &dyop::HapticTick::tool_clearances,
                                 dyop::c::clearance_record, clearances, capacity, count,
                                 "dyop_tool_clearance");
}

dyop_status dyop_haptic_session_destroy(dyop_context* context, dyop_haptic_session session) {
  return guard(context,
               [&] { context->remove(context->haptic_sessions, session, "the haptic session"); });
}

dyop_status dyop_haptic_update(dyop_context* context, dyop_haptic_session session,
                               const dyop_device_pose* device, double dt, double seconds,
                               dyop_haptic_tick* tick) {
  return guard(context, [&] {
    auto out = dyop::c::sized_array(tick, 1, "dyop_haptic_tick");
    const auto object = context->haptic_session(session);
    const dyop::DevicePose pose = dyop::c::device_from(*require_given(device, "device"));
    out.write(0, dyop::c::tick_record(object->update(pose, dt, dyop::c::haptic_deadline(seconds))));
  });
}

dyop_status dyop_haptic_contacts(dyop_context* context, dyop_haptic_session session,
                                 dyop_tool_contact* contacts, size_t capacity, size_t* count) {
  return dyop_haptic_contacts_of(context, session, 0, contacts, capacity, count);
}

dyop_status dyop_haptic_impulses(dyop_context* context, dyop_haptic_session session,
                                 dyop_tool_impulse* impulses, size_t capacity, size_t* count) {
  return dyop_haptic_impulses_of(context, session, 0, impulses, capacity, count);
}

dyop_status dyop_haptic_clearances(dyop_context* context, dyop_haptic_session session,
                                   dyop_tool_clearance* clearances, size_t capacity,
                                   size_t* count) {
  return dyop_haptic_clearances_of(context, session, 0, clearances, capacity, count);
}

dyop_status dyop_haptic_set_coupling_of(dyop_context* context, dyop_haptic_session session,
                                        size_t tool, const dyop_coupling* coupling) {
  return guard(context, [&] {
    context->haptic_session(session)->set_coupling(
        dyop::c::coupling_from(*require_given(coupling, "coupling")), tool);
  });
}

dyop_status dyop_haptic_set_coupling(dyop_context* context, dyop_haptic_session session,
                                     const dyop_coupling* coupling) {
  return dyop_haptic_set_coupling_of(context, session, 0, coupling);
}

dyop_status dyop_haptic_reset_of(dyop_context* context, dyop_haptic_session session, size_t tool,
                                 const dyop_device_pose* pose) {
  return guard(context, [&] {
    context->haptic_session(session)->reset(dyop::c::tool_from(*require_given(pose, "pose")), tool);
  });
}

dyop_status dyop_haptic_reset(dyop_context* context, dyop_haptic_session session,
                              const dyop_device_pose* tool) {
  return dyop_haptic_reset_of(context, session, 0, tool);
}

dyop_status dyop_haptic_give_snapshot(dyop_context* context, dyop_haptic_session session,
                                      size_t obstacle, const double* vertices, size_t vertex_count,
                                      double seconds, int32_t* is_taken) {
  return guard(context, [&] {
    const auto object = context->haptic_session(session);
    const auto rows = dyop::c::rows_from(vertices, vertex_count, "vertices");
    require_given(is_taken, "is_taken");
    *is_taken = object->give_snapshot(obstacle, rows, seconds) ? 1 : 0;
  });
}

dyop_status dyop_haptic_retarget(dyop_context* context, dyop_haptic_session session,
                                 size_t obstacle, const double* vertices, size_t vertex_count,
                                 double seconds, double lead, int32_t* is_taken) {
  return guard(context, [&] {
    const auto object = context->haptic_session(session);
    const auto rows = dyop::c::rows_from(vertices, vertex_count, "vertices");
    require_given(is_taken, "is_taken");
    *is_taken = object->retarget(obstacle, rows, seconds, lead) ? 1 : 0;
  });
}

dyop_status dyop_haptic_give_mesh(dyop_context* context, dyop_haptic_session session,
                                  size_t obstacle, const double* vertices, size_t vertex_count,
                                  const int32_t* triangles, size_t triangle_count,
                                  int32_t* is_taken) {
  return guard(context, [&] {
    const auto object = context->haptic_session(session);
    const auto rows = dyop::c::rows_from(vertices, vertex_count, "vertices");
    const auto numbers = dyop::c::triangles_from(triangles, triangle_count);
    require_given(is_taken, "is_taken");
    *is_taken = object->give_mesh(obstacle, rows, numbers) ? 1 : 0;
  });
}
