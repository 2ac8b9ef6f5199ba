// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/session_json.h"

#include <array>
#include <limits>

#include "dyop/core/error.h"

namespace dyop::io_internal {
namespace {

constexpr std::array<const char*, 4> kRoleNames{"tissue", "hard", "soft", "monitor"};

// JSON has no infinity.
Json limit_json(Scalar limit) {
  return limit < kInfinity ? Json(limit) : Json(nullptr);
}

Scalar limit_from(const Json& json) {
  return json.is_null() ? kInfinity : json.get<Scalar>();
}

Json axes_json(const Vector3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Vector3 axes_from(const Json& json) {
  return {json.at(0).get<Scalar>(), json.at(1).get<Scalar>(), json.at(2).get<Scalar>()};
}

Json options_json(const HapticOptions& options) {
  const CouplingOptions& springs = options.coupling;
  return {{"stiffness", axes_json(springs.stiffness)},
          {"damping", axes_json(springs.damping)},
          {"rotational_stiffness", axes_json(springs.rotational_stiffness)},
          {"rotational_damping", axes_json(springs.rotational_damping)},
          {"largest_force", limit_json(springs.largest_force)},
          {"largest_torque", limit_json(springs.largest_torque)},
          {"device_damping", springs.device_damping},
          {"device_rotational_damping", springs.device_rotational_damping},
          {"period", springs.period},
          {"bounds_energy", springs.bounds_energy},
          {"rest_offset", options.rest_offset},
          {"recovery_speed", options.recovery_speed},
          {"max_rounds", options.max_rounds},
          {"max_attempts", options.max_attempts},
          {"max_contacts", options.max_contacts},
          {"clearance_tolerance", options.clearance_tolerance},
          {"clearance_work", options.clearance_work},
          {"max_work", options.max_work},
          {"largest_device_speed", limit_json(options.largest_device_speed)}};
}

HapticOptions options_from(const Json& json) {
  HapticOptions options;
  CouplingOptions& springs = options.coupling;
  springs.stiffness = axes_from(json.at("stiffness"));
  springs.damping = axes_from(json.at("damping"));
  springs.rotational_stiffness = axes_from(json.at("rotational_stiffness"));
  springs.rotational_damping = axes_from(json.at("rotational_damping"));
  springs.largest_force = limit_from(json.at("largest_force"));
  springs.largest_torque = limit_from(json.at("largest_torque"));
  springs.device_damping = json.at("device_damping").get<Scalar>();
  springs.device_rotational_damping = json.at("device_rotational_damping").get<Scalar>();
  springs.period = json.at("period").get<Scalar>();
  springs.bounds_energy = json.at("bounds_energy").get<bool>();
  options.rest_offset = json.at("rest_offset").get<Scalar>();
  options.recovery_speed = json.at("recovery_speed").get<Scalar>();
  options.max_rounds = json.at("max_rounds").get<int>();
  options.max_attempts = json.at("max_attempts").get<int>();
  options.max_contacts = json.at("max_contacts").get<int>();
  options.clearance_tolerance = json.at("clearance_tolerance").get<Scalar>();
  options.clearance_work = json.value("clearance_work", options.clearance_work);
  // Older recordings know no limit.
  options.max_work = json.value("max_work", std::numeric_limits<std::int64_t>::max());
  if (json.contains("largest_device_speed")) {
    options.largest_device_speed = limit_from(json.at("largest_device_speed"));
  }
  return options;
}

Json obstacle_json(const ToolObstacle& obstacle, std::size_t shape, const TissueFeed* feed) {
  Json json{{"name", obstacle.name},
            {"role", kRoleNames.at(std::size_t(obstacle.role))},
            {"margin", obstacle.margin},
            {"friction", obstacle.friction},
            {"stiffness", obstacle.soft_stiffness},
            {"shape", shape},
            {"X_WO", pose_numbers(obstacle.X_WO)},
            {"deforms", deforms(obstacle)}};
  if (feed != nullptr && !feed->formula.empty()) {
    json["formula"] = Json::parse(feed->formula);
    json["period"] = feed->period;
  }
  return json;
}

ToolObstacle obstacle_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes) {
  ToolObstacle obstacle;
  obstacle.name = json.at("name").get<std::string>();
  const auto role = json.at("role").get<std::string>();
  const auto* const place = std::find(kRoleNames.begin(), kRoleNames.end(), role);
  DYOP_REQUIRE(place != kRoleNames.end(), "unknown role of an obstacle: ", role);
  obstacle.role = ObstacleRole(place - kRoleNames.begin());
  obstacle.margin = json.at("margin").get<Scalar>();
  obstacle.friction = json.at("friction").get<Scalar>();
  obstacle.soft_stiffness = json.at("stiffness").get<Scalar>();
  obstacle.X_WO = pose_from_numbers(json.at("X_WO"));
  const auto number = json.at("shape").get<std::size_t>();
  DYOP_REQUIRE(number < shapes.size(), "an obstacle has the shape ", number, ", which is missing");
  if (!json.at("deforms").get<bool>()) {
    obstacle.shape = shapes[number];
    return obstacle;
  }
  const auto* mesh = dynamic_cast<const TriangleMesh*>(shapes[number].get());
  DYOP_REQUIRE(mesh != nullptr, "the shape of an obstacle that deforms is no mesh");
  obstacle.vertices.assign(mesh->vertices().begin(), mesh->vertices().end());
  obstacle.triangles.assign(mesh->triangles().begin(), mesh->triangles().end());
  return obstacle;
}

}  // namespace

SessionText session_text(const HapticScene& scene, const HapticOptions& options,
                         std::span<const TissueFeed> tissue) {
  SessionText text;
  ShapeWriter shapes;
  Json json{{"X_WT", pose_numbers(scene.X_WT)},
            {"parts", Json::array()},
            {"hinges", Json::array()},
            {"obstacles", Json::array()},
            {"options", options_json(options)}};
  for (const ToolPart& part : scene.tool) {
    const std::size_t shape = shapes.add(part.shape, text.shapes, text.rows);
    json["parts"].push_back({{"shape", shape},
                             {"X_TP", pose_numbers(part.X_TP)},
                             {"hinge", part.hinge ? Json(*part.hinge) : Json(nullptr)}});
  }
  for (const ToolHinge& hinge : scene.hinges) {
    json["hinges"].push_back({{"X_TJ", pose_numbers(hinge.X_TJ)},
                              {"angle", hinge.angle},
                              {"stiffness", hinge.stiffness}});
  }
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k) {
    const ToolObstacle& obstacle = scene.obstacles[k];
    const auto shape = deforms(obstacle) ? std::make_shared<const TriangleMesh>(obstacle.vertices,
                                                                                obstacle.triangles)
                                         : obstacle.shape;
    const std::size_t number = shapes.add(shape, text.shapes, text.rows);
    const auto feed = std::find_if(tissue.begin(), tissue.end(), [&](const TissueFeed& candidate) {
      return candidate.obstacle == k;
    });
    json["obstacles"].push_back(
        obstacle_json(obstacle, number, feed == tissue.end() ? nullptr : &*feed));
  }
  text.json = json.dump();
  return text;
}

StoredSession session_from(const Json& json, std::span<const std::shared_ptr<const Shape>> shapes) {
  StoredSession session;
  session.scene.X_WT = pose_from_numbers(json.at("X_WT"));
  for (const Json& item : json.at("parts")) {
    const auto number = item.at("shape").get<std::size_t>();
    DYOP_REQUIRE(number < shapes.size(), "a part has the shape ", number, ", which is missing");
    ToolPart part{shapes[number], pose_from_numbers(item.at("X_TP"))};
    if (!item.at("hinge").is_null()) part.hinge = item.at("hinge").get<std::size_t>();
    session.scene.tool.push_back(std::move(part));
  }
  for (const Json& item : json.at("hinges")) {
    session.scene.hinges.push_back({pose_from_numbers(item.at("X_TJ")),
                                    item.at("angle").get<Scalar>(),
                                    item.at("stiffness").get<Scalar>()});
  }
  for (const Json& item : json.at("obstacles")) {
    session.scene.obstacles.push_back(obstacle_from(item, shapes));
    SnapshotSource& source = session.sources.emplace_back();
    if (!item.contains("formula")) continue;
    source.formula = item.at("formula").dump();
    source.period = item.at("period").get<Scalar>();
  }
  session.options = options_from(json.at("options"));
  return session;
}

}  // namespace dyop::io_internal
