// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/tool_bodies.h"

#include "dyop/geometry/triangle_mesh.h"

namespace dyop::view_internal {
namespace {

const char* color_of(ObstacleRole role) {
  switch (role) {
    case ObstacleRole::Tissue:
      return "#d39a8c";
    case ObstacleRole::HardRegion:
      return "#c0392b";
    case ObstacleRole::SoftRegion:
      return "#d9a521";
    case ObstacleRole::Monitor:
      return "#4fb3bf";
  }
  return "";
}

const char* words_of_role(ObstacleRole role) {
  switch (role) {
    case ObstacleRole::Tissue:
      return "tissue";
    case ObstacleRole::HardRegion:
      return "forbidden region";
    case ObstacleRole::SoftRegion:
      return "region that pushes back";
    case ObstacleRole::Monitor:
      return "region that is watched";
  }
  return "";
}

// An open sheet would hide what is behind it.
bool is_open(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  return mesh != nullptr && !mesh->is_closed();
}

PageBody obstacle_body(const ToolObstacle& obstacle, std::shared_ptr<const Shape> shape) {
  PageBody body;
  body.name = obstacle.name;
  body.kind = BodyKind::Static;
  body.shape = std::move(shape);
  body.shape_name = words_of_role(obstacle.role);
  body.color = color_of(obstacle.role);
  body.is_ghost = obstacle.role == ObstacleRole::SoftRegion ||
                  obstacle.role == ObstacleRole::Monitor || is_open(*body.shape);
  return body;
}

constexpr const char* kToolColor = "#8a9bb0";
constexpr const char* kDeviceColor = "#3b82f6";

}  // namespace

std::vector<PageBody> ToolBodies::bodies() const {
  std::vector<PageBody> bodies;
  const auto add_parts = [&](const char* name, BodyKind kind, const char* color, bool is_ghost) {
    for (std::size_t k = 0; k < part_count(); ++k) {
      PageBody& body = bodies.emplace_back();
      body.name = part_count() > 1 ? std::string(name) + ", part " + std::to_string(k + 1) : name;
      body.kind = kind;
      body.shape = scene_.tool[k].shape;
      body.color = color;
      body.is_ghost = is_ghost;
    }
  };
  add_parts("tool", BodyKind::Dynamic, kToolColor, false);
  add_parts("device", BodyKind::Kinematic, kDeviceColor, true);
  for (const ToolObstacle& obstacle : scene_.obstacles) {
    const auto shape = obstacle.shape != nullptr ? obstacle.shape
                                                 : std::make_shared<const TriangleMesh>(
                                                       obstacle.vertices, obstacle.triangles);
    bodies.push_back(obstacle_body(obstacle, shape));
  }
  return bodies;
}

PageBody ToolBodies::later_mesh(std::size_t number, std::shared_ptr<const Shape> mesh) const {
  PageBody body = obstacle_body(scene_.obstacles[number], std::move(mesh));
  body.name += ", cut";
  return body;
}

RigidPose ToolBodies::part_pose(std::size_t number, const ToolPose& tool) const {
  const ToolPart& part = scene_.tool[number];
  if (!part.hinge) return tool.X_WT * part.X_TP;
  const RigidPose& X_TJ = scene_.hinges[*part.hinge].X_TJ;
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0, tool.angles[*part.hinge]));
  return tool.X_WT * X_TJ * RigidPose(turn, Vector3::Zero()) * X_TJ.inverse() * part.X_TP;
}

Scalar ToolBodies::reach(std::size_t part) const {
  return scene_.tool[part].shape->bounding_radius();
}

}  // namespace dyop::view_internal
