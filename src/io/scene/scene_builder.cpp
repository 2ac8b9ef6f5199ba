// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/scene_builder.h"

#include <cstdint>
#include <limits>
#include <sstream>

#include "io/motion_json.h"

namespace dyop::io_internal {

SceneBuilder::SceneBuilder(std::string title, Scalar end_time) {
  root_["title"] = std::move(title);
  root_["time"] = {{"end", end_time}, {"step", 0.01}};
  set_lengths(kGeneratedTarget, kGeneratedRestOffset);
  root_["forces"]["gravity"] = {0, 0, -9.81};
}

void SceneBuilder::set_lengths(Scalar target_distance, Scalar rest_offset) {
  root_["target_distance"] = target_distance;
  root_["rest_offset"] = rest_offset;
}

Json& SceneBuilder::add_body(const std::string& name, Json shape, const Vector3& position) {
  Json body;
  body["name"] = name;
  body["shape"] = std::move(shape);
  body["pose"]["position"] = vector_json(position);
  body["density"] = 1000;
  body["restitution"] = 0;
  bodies_.push_back(std::move(body));
  return bodies_.back();
}

Json& SceneBuilder::add_static_body(const std::string& name, Json shape, const Vector3& position) {
  Json& body = add_body(name, std::move(shape), position);
  body["kind"] = "static";
  body.erase("density");
  return body;
}

void SceneBuilder::add_floor(const Vector3& middle, Scalar half_length, Scalar half_width) {
  constexpr Scalar kHalfHeight = 0.5;
  add_static_body("floor", box_shape({half_length, half_width, kHalfHeight}),
                  {middle.x(), middle.y(), -kHalfHeight});
}

void SceneBuilder::set_friction(Scalar friction) {
  for (Json& body : bodies_) body["friction"] = friction;
}

void SceneBuilder::add_mesh(const std::string& file, std::string text) {
  meshes_.emplace_back(file, std::move(text));
}

// One body per line.
GeneratedScene SceneBuilder::finish() const {
  std::ostringstream text;
  text << "{\n";
  for (const auto& [key, value] : root_.items()) {
    text << Json(key).dump() << ": " << value.dump() << ",\n";
  }
  text << "\"bodies\": [\n";
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    text << bodies_[k].dump() << (k + 1 < bodies_.size() ? ",\n" : "\n");
  }
  text << "]\n}\n";
  return {text.str(), meshes_};
}

Json box_shape(const Vector3& half_extents) {
  return {{"box", {{"half_extents", vector_json(half_extents)}}}};
}

Json sphere_shape(Scalar radius) {
  return {{"sphere", {{"radius", radius}}}};
}

Json hull_shape(const std::vector<Vector3>& points) {
  Json list = Json::array();
  for (const Vector3& point : points) list.push_back(vector_json(point));
  return {{"hull", {{"points", list}}}};
}

Json mesh_shape(const std::string& file) {
  return {{"mesh", file}};
}

Json vector_json(const Vector3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json turn_json(const Vector3& axis, Scalar degrees) {
  return {{"axis", vector_json(axis)}, {"degrees", degrees}};
}

std::string obj_text(const std::vector<Vector3>& vertices,
                     const std::vector<std::array<int, 3>>& triangles) {
  std::ostringstream text;
  constexpr int kDigits = 17;  // enough for any double
  text.precision(kDigits);
  for (const Vector3& v : vertices) text << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& [a, b, c] : triangles) {
    text << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
  }
  return text.str();
}

namespace {

// Force and torque about the centre of mass of one spring.
Wrench evaluate(const SpringForce& spring, const MotionState& state, const Vector3& p_WBcm) {
  const Vector3 p_BoP_W = state.X_WB.rotation() * spring.p_BP;
  const Vector3 p_WP = state.X_WB.translation() + p_BoP_W;
  const Vector3 v_WP = state.twist.v_WB + state.twist.w_WB.cross(p_BoP_W);
  Wrench wrench;
  wrench.force = -spring.stiffness * (p_WP - spring.p_WA) - spring.damping * v_WP;
  wrench.torque = (p_WP - p_WBcm).cross(wrench.force);
  return wrench;
}

}  // namespace

WrenchCallback make_wrench(const BodyForces& forces, const Vector3& p_BoBcm) {
  return [forces, p_BoBcm](Scalar /*t*/, const MotionState& state) {
    const Vector3 p_BoBcm_W = state.X_WB.rotation() * p_BoBcm;
    const Vector3 p_WBcm = state.X_WB.translation() + p_BoBcm_W;
    const Vector3 v_WBcm = state.twist.v_WB + state.twist.w_WB.cross(p_BoBcm_W);
    Wrench sum = forces.constant;
    sum.force -= forces.linear_drag * v_WBcm;
    sum.torque -= forces.angular_drag * state.twist.w_WB;
    for (const SpringForce& spring : forces.springs) {
      const Wrench wrench = evaluate(spring, state, p_WBcm);
      sum.force += wrench.force;
      sum.torque += wrench.torque;
    }
    return sum;
  };
}

namespace {

void forbid(const JsonNode& node, std::string_view key, std::string_view why) {
  if (node.has(key)) node.at(key).fail(std::string(why));
}

MassProperties compute_mass(const Shape& shape, bool is_shell, Scalar density) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  if (is_shell && mesh != nullptr) return mesh->compute_shell_mass_properties(density);
  return shape.compute_mass_properties(density);
}

MassProperties read_mass(const JsonNode& node, const Shape& shape, bool is_shell) {
  if (node.has("density") == node.has("mass")) {
    node.fail("a dynamic body needs either density or mass");
  }
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  if (mesh != nullptr && !is_shell && !mesh->is_closed()) {
    node.at("shape").fail(
        "the mesh is not closed, so it has no volume; for a surface, add "
        "\"shell\": true next to \"shape\"");
  }
  const JsonNode value = node.at(node.has("density") ? "density" : "mass");
  const Scalar amount = value.positive_number();
  return value.guard([&] {
    if (node.has("density")) return compute_mass(shape, is_shell, amount);
    return with_mass(compute_mass(shape, is_shell, 1), amount);
  });
}

std::array<bool, 3> read_three_flags(const JsonNode& node) {
  const std::vector<JsonNode> items = node.items();
  if (items.size() != 3) node.fail_expected("three Booleans");
  return {items[0].boolean(), items[1].boolean(), items[2].boolean()};
}

LockedAxes read_locked(const JsonNode& node) {
  node.require_object({"translation", "rotation"});
  LockedAxes locked;
  if (node.has("translation")) locked.translation = read_three_flags(node.at("translation"));
  if (node.has("rotation")) locked.rotation = read_three_flags(node.at("rotation"));
  return locked;
}

std::uint64_t read_bits(const JsonNode& node) {
  if (!node.value().is_number_unsigned()) node.fail_expected("an integer >= 0 below 2^64");
  return node.value().get<std::uint64_t>();
}

CollisionFilter read_filter(const JsonNode& node) {
  node.require_object({"category", "mask", "group"});
  CollisionFilter filter;
  if (const auto value = node.find("category")) filter.category = read_bits(*value);
  if (const auto value = node.find("mask")) filter.mask = read_bits(*value);
  if (const auto value = node.find("group")) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    const bool is_integer = value->value().is_number_integer();
    const std::int64_t group = is_integer ? value->value().get<std::int64_t>() : kMost + 1;
    if (group < -kMost || group > kMost) value->fail_expected("an integer between -2^31 and 2^31");
    filter.group = static_cast<std::int32_t>(group);
  }
  return filter;
}

void read_dynamic(const JsonNode& node, bool is_shell, BodyDefinition& body) {
  forbid(node, "motion", "only a kinematic body can have a motion");
  if (node.has("pose")) body.initial.X_WB = read_pose(node.at("pose"));
  if (node.has("velocity")) body.initial.twist = read_twist(node.at("velocity"));
  if (node.has("locked")) body.locked = read_locked(node.at("locked"));
  body.mass_properties = read_mass(node, *body.shape, is_shell);
}

void read_static(const JsonNode& node, BodyDefinition& body) {
  forbid(node, "motion", "only a kinematic body can have a motion");
  for (const std::string_view key : {"velocity", "density", "mass", "locked"}) {
    forbid(node, key, "only a dynamic body can have this key");
  }
  if (node.has("pose")) body.initial.X_WB = read_pose(node.at("pose"));
}

void read_kinematic(const JsonNode& node, const TimeInterval& span, BodyDefinition& body) {
  forbid(node, "pose", "a kinematic body's pose is given by its motion");
  for (const std::string_view key : {"velocity", "density", "mass", "locked"}) {
    forbid(node, key, "only a dynamic body can have this key");
  }
  const JsonNode motion = node.at("motion");
  body.motion = read_motion(motion);
  motion.guard([&] { require_defined(*body.motion, span, "the motion of a scene's body"); });
}

}  // namespace

NamedBody read_body(const JsonNode& node, const TimeInterval& span, ShapeReader& shapes) {
  node.require_object({"name", "kind", "shape", "shell", "pose", "velocity", "density", "mass",
                       "motion", "locked", "restitution", "friction", "rolling_friction",
                       "torsional_friction", "sensor", "filter"});
  NamedBody result;
  BodyDefinition& body = result.definition;
  body.name = node.at("name").text();
  if (body.name.empty()) node.at("name").fail_expected("a string that is not empty");
  const bool is_shell = node.has("shell") && node.at("shell").boolean();
  ShapeReader::NamedShape shape = shapes.read(node.at("shape"), is_shell);
  if (is_shell && shape.shape->kind() != ShapeKind::TriangleMesh) {
    node.at("shell").fail("only a mesh can be a shell");
  }
  body.shape = std::move(shape.shape);
  result.shape_name = std::move(shape.name);
  if (node.has("kind")) {
    body.kind = node.at("kind").choice<BodyKind>({{"dynamic", BodyKind::Dynamic},
                                                  {"kinematic", BodyKind::Kinematic},
                                                  {"static", BodyKind::Static}});
  }
  if (body.kind == BodyKind::Dynamic) read_dynamic(node, is_shell, body);
  if (body.kind == BodyKind::Static) read_static(node, body);
  if (body.kind == BodyKind::Kinematic) read_kinematic(node, span, body);
  if (node.has("friction")) body.friction = node.at("friction").non_negative_number();
  if (const auto rolling = node.find("rolling_friction")) {
    body.rolling_friction = rolling->non_negative_number();
  }
  if (const auto torsional = node.find("torsional_friction")) {
    body.torsional_friction = torsional->non_negative_number();
  }
  if (node.has("sensor")) body.is_sensor = node.at("sensor").boolean();
  if (node.has("filter")) body.filter = read_filter(node.at("filter"));
  if (const auto restitution = node.find("restitution")) {
    body.restitution = restitution->non_negative_number();
    if (!(body.restitution <= 1)) restitution->fail_expected("a number from 0 to 1");
  }
  return result;
}

}  // namespace dyop::io_internal
