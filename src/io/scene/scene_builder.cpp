// SPDX-License-Identifier: BSD-3-Clause
#include "io/scene/scene_builder.h"

#include <sstream>

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

}  // namespace dyop::io_internal
