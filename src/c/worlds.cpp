// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>

#include "c/context.h"
#include "c/convert.h"

namespace dyop::c {
namespace {

// The enumerators of C match those of C++, in the same order.
static_assert(int(BodyKind::Static) == DYOP_STATIC);
static_assert(int(ImpactPolicy::Impulse) == DYOP_IMPACT_IMPULSE);
static_assert(int(AdvanceStatus::BudgetExhausted) == DYOP_ADVANCE_BUDGET_EXHAUSTED);
static_assert(int(AdvanceStatus::Blocked) == DYOP_ADVANCE_BLOCKED);
static_assert(int(AdvanceStatus::Cancelled) == DYOP_ADVANCE_CANCELLED);
static_assert(int(JointKind::Hinge) == DYOP_JOINT_HINGE);
static_assert(int(JointKind::Distance) == DYOP_JOINT_DISTANCE);
static_assert(int(JointKind::Coupling) == DYOP_JOINT_COUPLING);
static_assert(int(CombineRule::Product) == DYOP_COMBINE_PRODUCT);
static_assert(int(CombineRule::Maximum) == DYOP_COMBINE_MAXIMUM);

CombineRule rule_from(std::int32_t rule) {
  DYOP_REQUIRE(rule >= DYOP_COMBINE_GEOMETRIC_MEAN && rule <= DYOP_COMBINE_MAXIMUM,
               "a rule to combine coefficients must be a dyop_combine_rule, not ", rule);
  return static_cast<CombineRule>(rule);
}

WorldOptions options_from(const dyop_world_options* given) {
  const auto c =
      read_struct<dyop_world_options>(given, DYOP_WORLD_OPTIONS_INIT, "dyop_world_options");
  DYOP_REQUIRE(c.policy == DYOP_IMPACT_STOP || c.policy == DYOP_IMPACT_IMPULSE,
               "policy of a world must be DYOP_IMPACT_STOP or DYOP_IMPACT_IMPULSE, not ", c.policy);
  DYOP_REQUIRE(c.max_step >= 0, "max_step of a world must be >= 0, not ", c.max_step);
  WorldOptions options;
  options.policy = static_cast<ImpactPolicy>(c.policy);
  options.gravity_W = vector_from(c.gravity);
  if (c.max_step > 0) options.max_step = c.max_step;
  if (!(c.target_distance < 0)) options.target_distance = c.target_distance;
  if (c.rest_offset != 0) options.rest_offset = c.rest_offset;
  if (!(c.restitution_speed < 0)) options.restitution_speed = c.restitution_speed;
  if (!(c.sleep_speed < 0)) options.sleep_speed = c.sleep_speed;
  options.sleep_steps = c.sleep_steps;
  options.combine_friction = rule_from(c.combine_friction);
  options.combine_restitution = rule_from(c.combine_restitution);
  options.thread_count = c.thread_count;
  options.records_motions = false;
  if (c.on_step) options.on_step = [c](Scalar t) { c.on_step(c.user, t); };
  return options;
}

WrenchCallback wrench_from(dyop_wrench_callback callback, void* user) {
  if (!callback) return {};
  return [callback, user](Scalar t, const MotionState& state) {
    const dyop_state at = to_c(state);
    dyop_wrench wrench{};
    callback(user, t, &at, &wrench);
    return Wrench{vector_from(wrench.force), vector_from(wrench.torque)};
  };
}

CollisionFilter filter_from(const dyop_collision_filter& c) {
  return {c.category, c.mask, c.group};
}

Material material_from(const dyop_material& c) {
  return {c.restitution, c.friction, c.rolling_friction, c.torsional_friction};
}

JointMotor motor_from(const dyop_joint_motor& c) {
  JointMotor motor;
  motor.speed = c.speed;
  motor.strength = c.strength;
  if (c.stiffness != 0) motor.position = c.position;
  motor.stiffness = c.stiffness;
  motor.damping = c.damping;
  return motor;
}

BodyDefinition definition_from(const dyop_context& context, const dyop_body_definition& c) {
  DYOP_REQUIRE(c.kind >= DYOP_DYNAMIC && c.kind <= DYOP_STATIC,
               "kind of a body must be DYOP_DYNAMIC, DYOP_KINEMATIC or DYOP_STATIC, not ", c.kind);
  BodyDefinition definition;
  definition.kind = static_cast<BodyKind>(c.kind);
  definition.shape = context.shape(c.shape);
  definition.restitution = c.restitution;
  definition.friction = c.friction;
  definition.rolling_friction = c.rolling_friction;
  definition.torsional_friction = c.torsional_friction;
  definition.filter = filter_from(c.filter);
  definition.is_sensor = c.is_sensor != 0;
  switch (definition.kind) {
    case BodyKind::Dynamic:
      definition.mass_properties = definition.shape->compute_mass_properties(c.density);
      definition.wrench = wrench_from(c.wrench, c.user);
      [[fallthrough]];
    case BodyKind::Static:
      definition.initial = state_from(c.initial);
      break;
    case BodyKind::Kinematic:
      definition.motion = context.motion(c.motion);
      break;
  }
  return definition;
}

BodyId find_body(const World& world, dyop_body body) {
  const BodyId id = body_from(body);
  if (body.generation == 0 || !world.has_body(id)) {
    throw StaleHandle(core_internal::compose_message("body ", body.index, " of generation ",
                                                     body.generation, " is stale"));
  }
  return id;
}

JointId find_joint(const World& world, dyop_joint joint) {
  const std::vector<JointId> all = world.joints();
  const JointId id{joint.number - 1};
  if (std::find(all.begin(), all.end(), id) == all.end()) {
    throw StaleHandle(core_internal::compose_message("joint ", joint.number, " is stale"));
  }
  return id;
}

JointDefinition definition_from(const World& world, const dyop_joint_definition& c) {
  DYOP_REQUIRE(c.kind >= DYOP_JOINT_BALL && c.kind <= DYOP_JOINT_COUPLING,
               "kind of a joint must be a dyop_joint_kind, not ", c.kind);
  JointDefinition joint;
  joint.kind = static_cast<JointKind>(c.kind);
  if (joint.kind == JointKind::Coupling) {
    joint.first = find_joint(world, c.first);
    joint.second = find_joint(world, c.second);
    joint.ratio = c.ratio;
  } else {
    joint.a = find_body(world, c.a);
    joint.b = find_body(world, c.b);
  }
  joint.X_AJ = pose_from(c.pose_a);
  joint.X_BJ = pose_from(c.pose_b);
  if (c.has_limits != 0) joint.limits = {c.limit_min, c.limit_max};
  if (c.has_motor != 0) joint.motor = motor_from(c.motor);
  if (c.has_swing_twist != 0) joint.swing_twist = {c.swing, c.twist_min, c.twist_max};
  joint.friction = c.friction;
  joint.damping = c.damping;
  joint.break_force = c.break_force;
  joint.break_torque = c.break_torque;
  joint.bodies_collide = c.bodies_collide != 0;
  return joint;
}

dyop_joint_values values_record(const JointValues& values) {
  dyop_joint_values c{};
  c.angle = values.angle;
  c.angle_rate = values.angle_rate;
  c.second_angle = values.second_angle;
  c.second_rate = values.second_rate;
  c.swing = values.swing;
  c.position = values.position;
  c.position_rate = values.position_rate;
  c.separation = values.separation;
  write_vector(values.force_W, c.force);
  write_vector(values.torque_W, c.torque);
  c.drive = values.drive;
  return c;
}

SpringDefinition definition_from(const World& world, const dyop_spring_definition& c) {
  SpringDefinition spring;
  spring.a = find_body(world, c.a);
  spring.b = find_body(world, c.b);
  spring.p_AP = vector_from(c.point_a);
  spring.p_BQ = vector_from(c.point_b);
  if (!(c.rest_length < 0)) spring.rest_length = c.rest_length;
  spring.stiffness = c.stiffness;
  spring.damping = c.damping;
  return spring;
}

// Changes a world, or one body of it.
template <typename Change>
dyop_status change_world(dyop_context* context, dyop_world world, const Change& change) {
  return guard(context, [&] {
    const auto object = context->world(world);
    change(object->to_change());
  });
}

template <typename Change>
dyop_status change_body(dyop_context* context, dyop_world world, dyop_body body,
                        const Change& change) {
  return change_world(context, world,
                      [&](World& changed) { change(changed, find_body(changed, body)); });
}

dyop_impact impact_record(const ImpactEvent& event) {
  dyop_impact impact{};
  impact.t = event.t;
  impact.a = to_c(event.a);
  impact.b = to_c(event.b);
  if (event.toi.contact) {
    impact.witness = to_c(static_cast<const WitnessPair&>(*event.toi.contact));
    impact.closing_speed = event.toi.contact->closing_speed;
  }
  return impact;
}

dyop_contact contact_record(const PairRecord& pair, const PairContact& touched) {
  dyop_contact contact{};
  contact.a = to_c(pair.a);
  contact.b = to_c(pair.b);
  write_vector(touched.point.p_WCa, contact.point_a);
  write_vector(touched.point.p_WCb, contact.point_b);
  write_vector(touched.point.nhat_AB_W, contact.normal);
  contact.gap = touched.point.gap;
  write_vector(touched.impulse_W, contact.impulse);
  return contact;
}

dyop_touch_event touch_record(const BodyId& a, const BodyId& b, Scalar t, bool is_begin) {
  return {sizeof(dyop_touch_event), is_begin ? 1 : 0, to_c(a), to_c(b), t};
}

dyop_body body_or_none(const std::optional<BodyId>& id) {
  return id ? to_c(*id) : dyop_body{};
}

// Reads the filter and asks the world; `query` gets both.
template <typename Query>
dyop_status ask_world(dyop_context* context, dyop_world world, const dyop_body_filter* given,
                      const Query& query) {
  return guard(context, [&] {
    const auto c = read_struct<dyop_body_filter>(given, DYOP_BODY_FILTER_INIT, "dyop_body_filter");
    BodyFilter filter{c.mask, c.category, c.includes_sensors != 0, {}};
    if (c.accepts) {
      filter.accepts = [c](BodyId id) { return c.accepts(c.user, to_c(id)) != 0; };
    }
    context->world(world)->ask([&](const World& asked) { query(asked, filter); });
  });
}

}  // namespace
}  // namespace dyop::c

using dyop::c::find_body;
using dyop::c::guard;
using dyop::c::require_given;

dyop_status dyop_world_create(dyop_context* context, const dyop_world_options* options,
                              dyop_world* world) {
  return guard(context, [&] {
    context->add<dyop::c::WorldObject>(context->worlds, world, dyop::c::options_from(options));
  });
}

dyop_status dyop_world_destroy(dyop_context* context, dyop_world world) {
  return guard(context, [&] { context->remove(context->worlds, world, "the world"); });
}

dyop_status dyop_world_add_body(dyop_context* context, dyop_world world,
                                const dyop_body_definition* definition, dyop_body* body) {
  return guard(context, [&] {
    const auto given = dyop::c::read_struct<dyop_body_definition>(
        require_given(definition, "definition"), DYOP_BODY_DEFINITION_INIT, "dyop_body_definition");
    require_given(body, "body");
    const auto object = context->world(world);
    dyop::World& changed = object->to_change();
    *body = dyop::c::to_c(changed.add_body(dyop::c::definition_from(*context, given)));
  });
}

dyop_status dyop_world_remove_body(dyop_context* context, dyop_world world, dyop_body body) {
  return guard(context, [&] {
    const auto object = context->world(world);
    dyop::World& changed = object->to_change();
    changed.remove_body(find_body(changed, body));
  });
}

dyop_status dyop_world_set_state(dyop_context* context, dyop_world world, dyop_body body,
                                 const dyop_state* state) {
  return guard(context, [&] {
    const auto object = context->world(world);
    dyop::World& changed = object->to_change();
    changed.set_state(find_body(changed, body),
                      dyop::c::state_from(*require_given(state, "state")));
  });
}

dyop_status dyop_world_set_motion(dyop_context* context, dyop_world world, dyop_body body,
                                  dyop_motion motion) {
  return guard(context, [&] {
    const auto object = context->world(world);
    dyop::World& changed = object->to_change();
    changed.set_motion(find_body(changed, body), context->motion(motion));
  });
}

dyop_status dyop_world_set_pair_enabled(dyop_context* context, dyop_world world, dyop_body a,
                                        dyop_body b, int32_t is_enabled) {
  return guard(context, [&] {
    const auto object = context->world(world);
    dyop::World& changed = object->to_change();
    changed.set_pair_enabled(find_body(changed, a), find_body(changed, b), is_enabled != 0);
  });
}

dyop_status dyop_world_states(dyop_context* context, dyop_world world, const dyop_body* bodies,
                              size_t count, dyop_state* states) {
  return guard(context, [&] {
    const auto object = context->world(world);
    DYOP_REQUIRE(count == 0 || (bodies && states), "bodies and states must not be null");
    for (std::size_t i = 0; i < count; ++i) {
      states[i] = dyop::c::to_c(object->to_read().state(find_body(object->to_read(), bodies[i])));
    }
  });
}

dyop_status dyop_world_advance(dyop_context* context, dyop_world world, double dt,
                               dyop_advance_report* report) {
  return guard(context, [&] {
    const auto object = context->world(world);
    auto out = dyop::c::sized_array(report, 1, "dyop_advance_report");
    const dyop::AdvanceReport found = object->advance(dt);
    out.write(0,
              {0, int(found.status), found.t, found.work.steps, object->events().impacts.size()});
  });
}

dyop_status dyop_world_advance_within(dyop_context* context, dyop_world world, double dt,
                                      double seconds, dyop_advance_report* report) {
  return guard(context, [&] {
    const auto object = context->world(world);
    auto out = dyop::c::sized_array(report, 1, "dyop_advance_report");
    dyop::AdvanceLimits limits;
    limits.deadline = dyop::c::deadline_after(seconds);
    const dyop::AdvanceReport found = object->advance(dt, limits);
    out.write(0,
              {0, int(found.status), found.t, found.work.steps, object->events().impacts.size()});
  });
}

dyop_status dyop_world_set_gravity(dyop_context* context, dyop_world world,
                                   const double gravity[3]) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    require_given(gravity, "gravity");
    changed.set_gravity({gravity[0], gravity[1], gravity[2]});
  });
}

dyop_status dyop_world_set_material(dyop_context* context, dyop_world world, dyop_body body,
                                    double restitution, double friction) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    const dyop::BodyDefinition& now = changed.body(id);
    changed.set_material(id, {restitution, friction, now.rolling_friction, now.torsional_friction});
  });
}

dyop_status dyop_world_set_wrench(dyop_context* context, dyop_world world, dyop_body body,
                                  dyop_wrench_callback wrench, void* user) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_wrench(id, dyop::c::wrench_from(wrench, user));
  });
}

dyop_status dyop_world_set_target_distance(dyop_context* context, dyop_world world, dyop_body a,
                                           dyop_body b, double target_distance) {
  return dyop::c::change_body(context, world, a, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_target_distance(id, find_body(changed, b), target_distance);
  });
}

dyop_status dyop_world_set_body_enabled(dyop_context* context, dyop_world world, dyop_body body,
                                        int32_t is_enabled) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_enabled(id, is_enabled != 0);
  });
}

dyop_status dyop_world_set_next_pose(dyop_context* context, dyop_world world, dyop_body body,
                                     const dyop_pose* pose, double t) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_next_pose(id, dyop::c::pose_from(*require_given(pose, "pose")), t);
  });
}

dyop_status dyop_world_wake(dyop_context* context, dyop_world world, dyop_body body) {
  return dyop::c::change_body(context, world, body,
                              [](dyop::World& changed, dyop::BodyId id) { changed.wake(id); });
}

dyop_status dyop_world_is_asleep(dyop_context* context, dyop_world world, dyop_body body,
                                 int32_t* is_asleep) {
  return guard(context, [&] {
    const auto object = context->world(world);
    const dyop::World& seen = object->to_read();
    *require_given(is_asleep, "is_asleep") = seen.is_asleep(find_body(seen, body)) ? 1 : 0;
  });
}

dyop_status dyop_world_add_joint(dyop_context* context, dyop_world world,
                                 const dyop_joint_definition* definition, dyop_joint* joint) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    const auto given = dyop::c::read_struct<dyop_joint_definition>(
        require_given(definition, "definition"), DYOP_JOINT_DEFINITION_INIT,
        "dyop_joint_definition");
    require_given(joint, "joint");
    const dyop::JointId id = changed.add_joint(dyop::c::definition_from(changed, given));
    *joint = dyop::c::numbered<dyop_joint>(id.number);
  });
}

dyop_status dyop_world_remove_joint(dyop_context* context, dyop_world world, dyop_joint joint) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    changed.remove_joint(dyop::c::find_joint(changed, joint));
  });
}

dyop_status dyop_world_set_motor(dyop_context* context, dyop_world world, dyop_joint joint,
                                 const dyop_joint_motor* motor) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    std::optional<dyop::JointMotor> wanted;
    if (motor) wanted = dyop::c::motor_from(*motor);
    changed.set_motor(dyop::c::find_joint(changed, joint), wanted);
  });
}

dyop_status dyop_world_joint_values(dyop_context* context, dyop_world world, dyop_joint joint,
                                    dyop_joint_values* values) {
  return guard(context, [&] {
    const auto object = context->world(world);
    const dyop::World& seen = object->to_read();
    auto out = dyop::c::sized_array(values, 1, "dyop_joint_values");
    out.write(0, dyop::c::values_record(seen.joint_values(dyop::c::find_joint(seen, joint))));
  });
}

dyop_status dyop_world_add_spring(dyop_context* context, dyop_world world,
                                  const dyop_spring_definition* definition, dyop_spring* spring) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    const auto given = dyop::c::read_struct<dyop_spring_definition>(
        require_given(definition, "definition"), DYOP_SPRING_DEFINITION_INIT,
        "dyop_spring_definition");
    require_given(spring, "spring");
    const dyop::SpringId id = changed.add_spring(dyop::c::definition_from(changed, given));
    *spring = dyop::c::numbered<dyop_spring>(id.number);
  });
}

dyop_status dyop_world_remove_spring(dyop_context* context, dyop_world world, dyop_spring spring) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    changed.remove_spring(dyop::SpringId{spring.number - 1});
  });
}

dyop_status dyop_world_snapshot(dyop_context* context, dyop_world world, dyop_snapshot* snapshot) {
  return dyop::c::change_world(context, world, [&](dyop::World& changed) {
    context->add<dyop::WorldSnapshot>(context->snapshots, snapshot, changed.snapshot());
  });
}

dyop_status dyop_world_restore(dyop_context* context, dyop_world world, dyop_snapshot snapshot) {
  return dyop::c::change_world(
      context, world, [&](dyop::World& changed) { changed.restore(*context->snapshot(snapshot)); });
}

dyop_status dyop_snapshot_destroy(dyop_context* context, dyop_snapshot snapshot) {
  return guard(context, [&] { context->remove(context->snapshots, snapshot, "the snapshot"); });
}

dyop_status dyop_world_impacts(dyop_context* context, dyop_world world, dyop_impact* impacts,
                               size_t capacity, size_t* count) {
  return guard(context, [&] {
    std::vector<dyop_impact> list;
    for (const dyop::ImpactEvent& event : context->world(world)->events().impacts) {
      list.push_back(dyop::c::impact_record(event));
    }
    dyop::c::hand_over(list, impacts, capacity, count, "dyop_impact");
  });
}

dyop_status dyop_world_contacts(dyop_context* context, dyop_world world, dyop_contact* contacts,
                                size_t capacity, size_t* count) {
  return guard(context, [&] {
    std::vector<dyop_contact> list;
    for (const dyop::PairRecord& pair : context->world(world)->to_read().contacts()) {
      for (const dyop::PairContact& touched : pair.contacts) {
        list.push_back(dyop::c::contact_record(pair, touched));
      }
    }
    dyop::c::hand_over(list, contacts, capacity, count, "dyop_contact");
  });
}

dyop_status dyop_world_contact_events(dyop_context* context, dyop_world world,
                                      dyop_touch_event* events, size_t capacity, size_t* count) {
  return guard(context, [&] {
    std::vector<dyop_touch_event> list;
    for (const dyop::ContactEvent& event : context->world(world)->events().contacts) {
      list.push_back(dyop::c::touch_record(event.a, event.b, event.t, event.is_begin));
    }
    dyop::c::hand_over(list, events, capacity, count, "dyop_touch_event");
  });
}

dyop_status dyop_world_sensor_events(dyop_context* context, dyop_world world,
                                     dyop_touch_event* events, size_t capacity, size_t* count) {
  return guard(context, [&] {
    std::vector<dyop_touch_event> list;
    for (const dyop::SensorEvent& event : context->world(world)->events().sensors) {
      list.push_back(dyop::c::touch_record(event.sensor, event.body, event.t, event.is_overlap));
    }
    dyop::c::hand_over(list, events, capacity, count, "dyop_touch_event");
  });
}

dyop_status dyop_world_broken_joints(dyop_context* context, dyop_world world,
                                     dyop_broken_joint* joints, size_t capacity, size_t* count) {
  return guard(context, [&] {
    std::vector<dyop_broken_joint> list;
    for (const dyop::BrokenJoint& broken : context->world(world)->events().broken_joints) {
      list.push_back({sizeof(dyop_broken_joint), 0,
                      dyop::c::numbered<dyop_joint>(broken.joint.number), dyop::c::to_c(broken.a),
                      dyop::c::to_c(broken.b), broken.t, broken.force, broken.torque});
    }
    dyop::c::hand_over(list, joints, capacity, count, "dyop_broken_joint");
  });
}

dyop_status dyop_world_apply_impulse(dyop_context* context, dyop_world world, dyop_body body,
                                     const double impulse[3], const double point[3]) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    require_given(impulse, "impulse");
    const dyop::Vector3 impulse_W(impulse[0], impulse[1], impulse[2]);
    if (!point) return changed.apply_impulse(id, impulse_W);
    changed.apply_impulse(id, impulse_W, {point[0], point[1], point[2]});
  });
}

dyop_status dyop_world_apply_angular_impulse(dyop_context* context, dyop_world world,
                                             dyop_body body, const double angular_impulse[3]) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    require_given(angular_impulse, "angular_impulse");
    changed.apply_angular_impulse(id, {angular_impulse[0], angular_impulse[1], angular_impulse[2]});
  });
}

dyop_status dyop_world_set_mass_properties(dyop_context* context, dyop_world world, dyop_body body,
                                           const dyop_mass_properties* properties) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_mass_properties(
        id, dyop::c::mass_properties_from(*require_given(properties, "properties")));
  });
}

dyop_status dyop_world_set_shape(dyop_context* context, dyop_world world, dyop_body body,
                                 dyop_shape shape) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_shape(id, context->shape(shape));
  });
}

dyop_status dyop_world_set_filter(dyop_context* context, dyop_world world, dyop_body body,
                                  const dyop_collision_filter* filter) {
  return dyop::c::change_body(context, world, body, [&](dyop::World& changed, dyop::BodyId id) {
    changed.set_filter(id, dyop::c::filter_from(*require_given(filter, "filter")));
  });
}

dyop_status dyop_world_set_pair_material(dyop_context* context, dyop_world world, dyop_body a,
                                         dyop_body b, const dyop_material* material) {
  return dyop::c::change_body(context, world, a, [&](dyop::World& changed, dyop::BodyId id) {
    std::optional<dyop::Material> given;
    if (material) given = dyop::c::material_from(*material);
    changed.set_pair_material(id, find_body(changed, b), given);
  });
}

dyop_status dyop_world_pair_material(dyop_context* context, dyop_world world, dyop_body a,
                                     dyop_body b, dyop_material* material) {
  return guard(context, [&] {
    const auto object = context->world(world);
    const dyop::World& seen = object->to_read();
    const dyop::Material found = seen.pair_material(find_body(seen, a), find_body(seen, b));
    *require_given(material, "material") = {found.restitution, found.friction,
                                            found.rolling_friction, found.torsional_friction};
  });
}

dyop_status dyop_world_cast_ray(dyop_context* context, dyop_world world, const double origin[3],
                                const double direction[3], double length,
                                const dyop_body_filter* filter, dyop_body_ray_hit* hit) {
  return dyop::c::ask_world(
      context, world, filter, [&](const dyop::World& asked, const dyop::BodyFilter& used) {
        require_given(origin, "origin");
        require_given(direction, "direction");
        auto out = dyop::c::sized_array(hit, 1, "dyop_body_ray_hit");
        const dyop::BodyRayHit found =
            asked.cast_ray({origin[0], origin[1], origin[2]},
                           {direction[0], direction[1], direction[2]}, length, used);
        dyop_body_ray_hit result{};
        result.status = int(found.status);
        result.body = dyop::c::body_or_none(found.body);
        result.distance = found.distance;
        dyop::c::write_vector(found.p_W, result.point);
        dyop::c::write_vector(found.nhat_W, result.normal);
        result.triangle = found.triangle.value_or(-1);
        out.write(0, result);
      });
}

dyop_status dyop_world_cast_shape(dyop_context* context, dyop_world world, dyop_shape shape,
                                  dyop_motion motion, dyop_interval interval,
                                  const dyop_toi_options* options, const dyop_body_filter* filter,
                                  dyop_toi_result* result, dyop_body* body) {
  return dyop::c::ask_world(
      context, world, filter, [&](const dyop::World& asked, const dyop::BodyFilter& used) {
        auto out = dyop::c::sized_array(result, 1, "dyop_toi_result");
        const dyop::ShapeHit found = asked.cast_shape(
            *context->shape(shape), *context->motion(motion), dyop::c::interval_from(interval),
            dyop::c::toi_options_from(options), used);
        *require_given(body, "body") = dyop::c::body_or_none(found.body);
        out.write(0, dyop::c::toi_result(found.toi));
      });
}

dyop_status dyop_world_nearest(dyop_context* context, dyop_world world, dyop_shape shape,
                               const dyop_pose* pose, const dyop_distance_options* options,
                               const dyop_body_filter* filter, dyop_distance_result* result,
                               dyop_body* body) {
  return dyop::c::ask_world(
      context, world, filter, [&](const dyop::World& asked, const dyop::BodyFilter& used) {
        auto out = dyop::c::sized_array(result, 1, "dyop_distance_result");
        const dyop::NearestBody found =
            asked.nearest(*context->shape(shape), dyop::c::pose_from(*require_given(pose, "pose")),
                          dyop::c::distance_options_from(options), used);
        *require_given(body, "body") = dyop::c::body_or_none(found.body);
        out.write(0, dyop::c::distance_result(found.distance));
      });
}

dyop_status dyop_world_overlaps(dyop_context* context, dyop_world world, dyop_shape shape,
                                const dyop_pose* pose, double max_distance,
                                const dyop_body_filter* filter, dyop_body* bodies, size_t capacity,
                                size_t* count, size_t* proven) {
  return dyop::c::ask_world(
      context, world, filter, [&](const dyop::World& asked, const dyop::BodyFilter& used) {
        DYOP_REQUIRE(bodies || capacity == 0, "bodies must not be null");
        const dyop::BodyOverlaps found =
            asked.overlaps(*context->shape(shape), dyop::c::pose_from(*require_given(pose, "pose")),
                           max_distance, used);
        std::vector<dyop::BodyId> all = found.bodies;
        all.insert(all.end(), found.undecided.begin(), found.undecided.end());
        for (std::size_t i = 0; i < std::min(capacity, all.size()); ++i) {
          bodies[i] = dyop::c::to_c(all[i]);
        }
        *require_given(count, "count") = all.size();
        *require_given(proven, "proven") = found.bodies.size();
      });
}
