// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_file.h"

#include <cmath>
#include <limits>

#include "io/file_bytes.h"
#include "io/motion_json.h"
#include "io/scene/scene_builder.h"

namespace dyop {
namespace {

using io_internal::BodyForces;
using io_internal::JsonNode;

BodyId body_named(const JsonNode& node, const Scene& scene) {
  const std::string name = node.text();
  for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
    if (scene.bodies[k].name == name) return BodyId(k);
  }
  node.fail_expected("the name of a body");
}

// Requires a number of steps that is finite and countable, and steps that advance the clock.
void require_countable(const JsonNode& step, const Scene& scene) {
  constexpr Scalar kMostSteps = 1e9;
  if (!(scene.end_time / step.positive_number() <= kMostSteps)) {
    step.fail_expected("a step of at least one part in 1e9 of the end time");
  }
}

void read_time(const JsonNode& node, Scene& scene) {
  node.require_object({"end", "step"});
  scene.end_time = node.at("end").positive_number();
  scene.step = node.at("step").positive_number();
  require_countable(node.at("step"), scene);
}

void read_bodies(const JsonNode& node, const std::vector<std::filesystem::path>& directories,
                 Scene& scene) {
  io_internal::ShapeReader shapes(directories);
  for (const JsonNode& item : node.items(1)) {
    io_internal::NamedBody body = io_internal::read_body(item, {0, scene.end_time}, shapes);
    for (const BodyDefinition& other : scene.bodies) {
      if (other.name == body.definition.name) {
        item.at("name").fail_expected("a name that no other body has");
      }
    }
    scene.bodies.push_back(std::move(body.definition));
    scene.shape_names.push_back(std::move(body.shape_name));
  }
}

io_internal::SpringForce read_spring(const JsonNode& node) {
  node.require_object({"body", "point", "anchor", "stiffness", "damping"});
  io_internal::SpringForce spring;
  if (node.has("point")) spring.p_BP = node.at("point").vector3();
  spring.p_WA = node.at("anchor").vector3();
  spring.stiffness = node.at("stiffness").non_negative_number();
  if (node.has("damping")) spring.damping = node.at("damping").non_negative_number();
  return spring;
}

// Index of the body that a force acts on.
std::size_t forced_body(const JsonNode& force, const Scene& scene) {
  const std::size_t id = body_named(force.at("body"), scene).slot;
  if (scene.bodies[id].kind != BodyKind::Dynamic) {
    force.at("body").fail_expected("a dynamic body: forces do not move others");
  }
  return id;
}

SpringDefinition read_link_spring(const JsonNode& node, const Scene& scene) {
  node.require_object({"a", "b", "point_a", "point_b", "rest_length", "stiffness", "damping"});
  SpringDefinition spring;
  spring.name = node.path();
  spring.a = body_named(node.at("a"), scene);
  spring.b = body_named(node.at("b"), scene);
  if (spring.a == spring.b) node.at("b").fail_expected("another body than a");
  if (node.has("point_a")) spring.p_AP = node.at("point_a").vector3();
  if (node.has("point_b")) spring.p_BQ = node.at("point_b").vector3();
  if (const auto value = node.find("rest_length"))
    spring.rest_length = value->non_negative_number();
  if (const auto value = node.find("stiffness")) spring.stiffness = value->non_negative_number();
  if (const auto value = node.find("damping")) spring.damping = value->non_negative_number();
  if (!(spring.stiffness > 0 || spring.damping > 0)) {
    node.fail("a spring needs a stiffness or a damping > 0");
  }
  return spring;
}

std::vector<JsonNode> list_or_empty(const JsonNode& node, std::string_view key) {
  return node.has(key) ? node.at(key).items() : std::vector<JsonNode>();
}

void read_forces(const JsonNode& node, Scene& scene) {
  node.require_object({"gravity", "wrenches", "springs", "drags"});
  if (node.has("gravity")) scene.options.gravity_W = node.at("gravity").vector3();
  std::vector<BodyForces> forces(scene.bodies.size());
  std::vector<bool> has_force(scene.bodies.size(), false);
  for (const JsonNode& item : list_or_empty(node, "wrenches")) {
    item.require_object({"body", "force", "torque"});
    const std::size_t id = forced_body(item, scene);
    if (item.has("force")) forces[id].constant.force += item.at("force").vector3();
    if (item.has("torque")) forces[id].constant.torque += item.at("torque").vector3();
    has_force[id] = true;
  }
  for (const JsonNode& item : list_or_empty(node, "springs")) {
    if (item.has("a")) {
      scene.springs.push_back(read_link_spring(item, scene));
      continue;
    }
    const std::size_t id = forced_body(item, scene);
    forces[id].springs.push_back(read_spring(item));
    has_force[id] = true;
  }
  for (const JsonNode& item : list_or_empty(node, "drags")) {
    item.require_object({"body", "linear", "angular"});
    const std::size_t id = forced_body(item, scene);
    if (item.has("linear")) forces[id].linear_drag += item.at("linear").non_negative_number();
    if (item.has("angular")) forces[id].angular_drag += item.at("angular").non_negative_number();
    has_force[id] = true;
  }
  for (std::size_t id = 0; id < scene.bodies.size(); ++id) {
    BodyDefinition& body = scene.bodies[id];
    if (has_force[id]) body.wrench = make_wrench(forces[id], body.mass_properties.p_BoBcm);
  }
}

void read_targets(const JsonNode& node, Scene& scene) {
  for (const JsonNode& item : node.items()) {
    item.require_object({"a", "b", "distance"});
    const SceneTarget target{body_named(item.at("a"), scene), body_named(item.at("b"), scene),
                             item.at("distance").non_negative_number()};
    if (target.a == target.b) item.at("b").fail_expected("a body other than a");
    scene.target_distances.push_back(target);
  }
}

void read_filters(const JsonNode& node, Scene& scene) {
  for (const JsonNode& group : node.items()) {
    const std::vector<JsonNode> names = group.items(2);
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const BodyId a = body_named(names[j], scene);
        const BodyId b = body_named(names[i], scene);
        if (a == b) names[i].fail_expected("each body only once in a group");
        scene.disabled_pairs.emplace_back(a, b);
      }
    }
  }
}

void read_integrator(const JsonNode& node, Scene& scene) {
  WorldOptions& options = scene.options;
  node.require_object(
      {"kind", "relative_tolerance", "absolute_tolerance", "max_step", "max_internal_steps"});
  if (node.has("kind")) {
    options.integrator =
        node.at("kind").choice<IntegratorKind>({{"arkode", IntegratorKind::Arkode},
                                                {"cvode_adams", IntegratorKind::CvodeAdams},
                                                {"cvode_bdf", IntegratorKind::CvodeBdf}});
  }
  IntegratorOptions& limits = options.integrator_options;
  if (const auto value = node.find("relative_tolerance")) {
    limits.relative_tolerance = value->positive_number();
  }
  if (const auto value = node.find("absolute_tolerance")) {
    limits.absolute_tolerance = value->positive_number();
  }
  if (const auto value = node.find("max_step")) {
    limits.max_step = value->positive_number();
    require_countable(*value, scene);
  }
  if (const auto value = node.find("max_internal_steps")) {
    limits.max_internal_steps = value->positive_integer();
  }
}

RigidPose initial_pose(const Scene& scene, const BodyId& id) {
  const BodyDefinition& body = scene.bodies[id.slot];
  return body.kind == BodyKind::Kinematic ? body.motion->pose(0) : body.initial.X_WB;
}

JointLimits read_limits(const JsonNode& node) {
  node.require_object({"min", "max"});
  return {node.at("min").number(), node.at("max").number()};
}

// Without gains it needs speed and strength.
JointMotor read_motor(const JsonNode& node) {
  node.require_object({"speed", "strength", "position", "stiffness", "damping"});
  JointMotor motor;
  const bool has_gains = node.has("stiffness") || node.has("damping");
  if (!has_gains || node.has("speed")) motor.speed = node.at("speed").number();
  motor.strength = kInfinity;
  if (!has_gains || node.has("strength")) motor.strength = node.at("strength").positive_number();
  if (const auto value = node.find("position")) motor.position = value->number();
  if (const auto value = node.find("stiffness")) motor.stiffness = value->non_negative_number();
  if (const auto value = node.find("damping")) motor.damping = value->non_negative_number();
  if (motor.position.has_value() != (motor.stiffness > 0)) {
    node.fail("a motor has a position with a stiffness > 0, and not without");
  }
  return motor;
}

SwingTwistLimits read_swing_twist(const JsonNode& node) {
  node.require_object({"swing", "twist_min", "twist_max"});
  SwingTwistLimits limits;
  if (const auto value = node.find("swing")) limits.swing = value->positive_number();
  if (const auto value = node.find("twist_min")) limits.twist_min = value->number();
  if (const auto value = node.find("twist_max")) limits.twist_max = value->number();
  return limits;
}

// What every joint may have.
void read_strength(const JsonNode& node, JointDefinition& joint) {
  if (const auto value = node.find("break_force")) joint.break_force = value->positive_number();
  if (const auto value = node.find("break_torque")) joint.break_torque = value->positive_number();
}

// Two points whose distance is kept, each in its body's frame.
JointDefinition read_distance_joint(const JsonNode& node, const Scene& scene) {
  node.require_object(
      {"name", "kind", "a", "b", "point_a", "point_b", "limits", "break_force", "break_torque"});
  JointDefinition joint;
  joint.kind = JointKind::Distance;
  joint.a = body_named(node.at("a"), scene);
  joint.b = body_named(node.at("b"), scene);
  if (node.has("point_a")) joint.X_AJ = RigidPose(node.at("point_a").vector3());
  if (node.has("point_b")) joint.X_BJ = RigidPose(node.at("point_b").vector3());
  return joint;
}

// x along the first axis, y along the second.
Quaternion universal_axes(const JsonNode& node, const Vector3& first) {
  const Vector3 second = node.at("second_axis").vector3();
  constexpr Scalar kSquare = 1e-6;  // literal: a cosine, as for quaternions
  if (!(std::abs(first.normalized().dot(second.normalized())) <= kSquare)) {
    node.at("second_axis").fail_expected("an axis at right angles to the first");
  }
  Matrix3 R;
  R.col(0) = first.normalized();
  R.col(2) = first.cross(second).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return Quaternion(R);
}

// Frames are given where they are at time 0, in the world.
JointDefinition read_framed_joint(const JsonNode& node, const Scene& scene) {
  node.require_object({"name", "kind", "a", "b", "point", "axis", "second_axis", "limits", "motor",
                       "swing_twist", "friction", "damping", "break_force", "break_torque"});
  JointDefinition joint;
  joint.kind = node.at("kind").choice<JointKind>({{"ball", JointKind::Ball},
                                                  {"hinge", JointKind::Hinge},
                                                  {"slider", JointKind::Slider},
                                                  {"fixed", JointKind::Fixed},
                                                  {"distance", JointKind::Distance},
                                                  {"universal", JointKind::Universal},
                                                  {"cylindrical", JointKind::Cylindrical},
                                                  {"coupling", JointKind::Coupling}});
  joint.a = body_named(node.at("a"), scene);
  joint.b = body_named(node.at("b"), scene);
  const Vector3 axis = node.has("axis") ? node.at("axis").vector3() : Vector3(0, 0, 1);
  if (!(axis.norm() > 0)) node.at("axis").fail_expected("an axis that is not zero");
  const Quaternion turn = joint.kind == JointKind::Universal
                              ? universal_axes(node, axis)
                              : rotation_between(Vector3::UnitZ(), axis);
  const RigidPose X_WJ(turn, node.at("point").vector3());
  joint.X_AJ = initial_pose(scene, joint.a).inverse() * X_WJ;
  joint.X_BJ = initial_pose(scene, joint.b).inverse() * X_WJ;
  if (node.has("motor")) joint.motor = read_motor(node.at("motor"));
  if (node.has("swing_twist")) joint.swing_twist = read_swing_twist(node.at("swing_twist"));
  if (const auto value = node.find("friction")) joint.friction = value->non_negative_number();
  if (const auto value = node.find("damping")) joint.damping = value->non_negative_number();
  return joint;
}

// A coupling of two earlier joints. A World numbers joints in order.
JointDefinition read_coupling(const JsonNode& node, const Scene& scene) {
  node.require_object(
      {"name", "kind", "first", "second", "ratio", "limits", "break_force", "break_torque"});
  JointDefinition joint;
  joint.kind = JointKind::Coupling;
  const auto joint_named = [&](const JsonNode& value) {
    const std::string name = value.text();
    for (std::size_t k = 0; k < scene.joints.size(); ++k) {
      if (scene.joints[k].name == name) return JointId{k};
    }
    value.fail_expected("the name of an earlier joint");
  };
  joint.first = joint_named(node.at("first"));
  joint.second = joint_named(node.at("second"));
  joint.ratio = node.at("ratio").number();
  return joint;
}

JointDefinition read_joint_of_kind(const JsonNode& node, const Scene& scene) {
  const std::string kind = node.at("kind").text();
  if (kind == "coupling") return read_coupling(node, scene);
  JointDefinition joint =
      kind == "distance" ? read_distance_joint(node, scene) : read_framed_joint(node, scene);
  if (joint.a == joint.b) node.at("b").fail_expected("another body than a");
  return joint;
}

JointDefinition read_joint(const JsonNode& node, const Scene& scene) {
  JointDefinition joint = read_joint_of_kind(node, scene);
  read_strength(node, joint);
  if (node.has("limits")) joint.limits = read_limits(node.at("limits"));
  joint.name = node.has("name") ? node.at("name").text() : node.path();
  for (const JointDefinition& other : scene.joints) {
    if (node.has("name") && other.name == joint.name) {
      node.at("name").fail_expected("a name that no other joint has");
    }
  }
  return joint;
}

std::vector<ScenePairMaterial> read_materials(const JsonNode& node, const Scene& scene) {
  std::vector<ScenePairMaterial> materials;
  for (const JsonNode& item : node.items()) {
    item.require_object(
        {"a", "b", "restitution", "friction", "rolling_friction", "torsional_friction"});
    ScenePairMaterial pair{body_named(item.at("a"), scene), body_named(item.at("b"), scene), {}};
    if (pair.a == pair.b) item.at("b").fail_expected("a body other than a");
    pair.material.restitution = item.at("restitution").non_negative_number();
    if (!(pair.material.restitution <= 1)) {
      item.at("restitution").fail_expected("a number from 0 to 1");
    }
    pair.material.friction = item.at("friction").non_negative_number();
    if (const auto value = item.find("rolling_friction")) {
      pair.material.rolling_friction = value->non_negative_number();
    }
    if (const auto value = item.find("torsional_friction")) {
      pair.material.torsional_friction = value->non_negative_number();
    }
    materials.push_back(pair);
  }
  return materials;
}

CombineRule read_rule(const JsonNode& node) {
  return node.choice<CombineRule>({{"geometric_mean", CombineRule::GeometricMean},
                                   {"mean", CombineRule::Mean},
                                   {"product", CombineRule::Product},
                                   {"minimum", CombineRule::Minimum},
                                   {"maximum", CombineRule::Maximum}});
}

int read_int(const JsonNode& node) {
  const std::int64_t value = node.positive_integer();
  if (value > std::numeric_limits<int>::max()) node.fail_expected("an integer below 2^31");
  return int(value);
}

void read_options(const JsonNode& root, Scene& scene) {
  WorldOptions& options = scene.options;
  if (const auto node = root.find("integrator")) read_integrator(*node, scene);
  if (const auto node = root.find("policy")) {
    options.policy = node->choice<ImpactPolicy>(
        {{"stop", ImpactPolicy::Stop}, {"impulse", ImpactPolicy::Impulse}});
  }
  if (const auto node = root.find("target_distance")) {
    options.target_distance = node->non_negative_number();
  }
  if (const auto node = root.find("rest_offset")) options.rest_offset = node->positive_number();
  if (const auto node = root.find("restitution_speed")) {
    options.restitution_speed = node->non_negative_number();
  }
  if (const auto node = root.find("combine_friction")) options.combine_friction = read_rule(*node);
  if (const auto node = root.find("combine_restitution")) {
    options.combine_restitution = read_rule(*node);
  }
  if (const auto node = root.find("separation_speed")) {
    options.separation_speed = node->positive_number();
  }
  if (const auto node = root.find("sleep_steps")) options.sleep_steps = read_int(*node);
  if (const auto node = root.find("max_node_pairs")) {
    options.max_node_pairs = node->positive_integer();
  }
}

void read_root(const JsonNode& root, const std::vector<std::filesystem::path>& directories,
               Scene& scene) {
  root.require_object({"title", "notes", "time", "bodies", "forces", "target_distance",
                       "target_distances", "rest_offset", "restitution_speed", "separation_speed",
                       "sleep_steps", "filters", "joints", "integrator", "policy", "max_node_pairs",
                       "materials", "combine_friction", "combine_restitution"});
  if (root.has("title")) scene.title = root.at("title").text();
  if (root.has("notes")) root.at("notes").text();
  read_time(root.at("time"), scene);
  read_options(root, scene);
  read_bodies(root.at("bodies"), directories, scene);
  if (const auto node = root.find("forces")) read_forces(*node, scene);
  if (const auto node = root.find("target_distances")) read_targets(*node, scene);
  if (const auto node = root.find("materials")) scene.materials = read_materials(*node, scene);
  for (const JsonNode& item : list_or_empty(root, "joints")) {
    scene.joints.push_back(read_joint(item, scene));
  }
  if (const auto node = root.find("filters")) read_filters(*node, scene);
}

}  // namespace

Scene load_scene(const std::filesystem::path& file,
                 const std::vector<std::filesystem::path>& mesh_directories) {
  const io_internal::Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
  std::vector<std::filesystem::path> directories{file.parent_path()};
  directories.insert(directories.end(), mesh_directories.begin(), mesh_directories.end());
  Scene scene;
  const JsonNode root(file, json);
  if (io_internal::is_rigid_ipc_scene(root)) {
    io_internal::read_rigid_ipc_scene(root, mesh_directories, scene);
  } else {
    read_root(root, directories, scene);
  }
  scene.source = json.dump();
  return scene;
}

World make_world(const Scene& scene) {
  World world(scene.options);
  for (const BodyDefinition& body : scene.bodies) world.add_body(body);
  for (const auto& [a, b] : scene.disabled_pairs) world.set_pair_enabled(a, b, false);
  for (const SceneTarget& target : scene.target_distances) {
    world.set_target_distance(target.a, target.b, target.distance);
  }
  for (const ScenePairMaterial& pair : scene.materials) {
    world.set_pair_material(pair.a, pair.b, pair.material);
  }
  for (const JointDefinition& joint : scene.joints) world.add_joint(joint);
  for (const SpringDefinition& spring : scene.springs) world.add_spring(spring);
  return world;
}

}  // namespace dyop
