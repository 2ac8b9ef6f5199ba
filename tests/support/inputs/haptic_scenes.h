// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "support/inputs/mesh_generators.h"

/// Small scenes of a haptic tool; lengths in millimetres, forces in newtons.
namespace dyop::testing {

inline HapticOptions haptic_options() {
  HapticOptions options;
  options.coupling.stiffness = Vector3::Constant(1);
  options.coupling.rotational_stiffness = Vector3::Constant(200);
  options.coupling.damping = Vector3::Zero();
  options.rest_offset = 0.02;
  options.recovery_speed = 50;
  return options;
}

inline std::shared_ptr<const TriangleMesh> shared_mesh(const testing::MeshArrays& arrays) {
  return std::make_shared<const TriangleMesh>(arrays.mesh());
}

/// A ball of facets for a tool, at a height over the origin.
inline HapticScene ball_tool(Scalar radius, const Vector3& p_WT, int subdivisions = 2) {
  HapticScene scene;
  scene.tool.push_back({shared_mesh(testing::icosphere(subdivisions, radius)), RigidPose()});
  scene.X_WT = RigidPose(p_WT);
  return scene;
}

inline ToolObstacle rigid_tissue(std::shared_ptr<const Shape> shape, const RigidPose& X_WO = {},
                                 Scalar friction = 0) {
  ToolObstacle obstacle;
  obstacle.name = "tissue";
  obstacle.shape = std::move(shape);
  obstacle.X_WO = X_WO;
  obstacle.friction = friction;
  return obstacle;
}

inline ToolObstacle deforming_tissue(const testing::MeshArrays& arrays, Scalar friction = 0) {
  ToolObstacle obstacle;
  obstacle.name = "organ";
  obstacle.vertices = arrays.vertices;
  obstacle.triangles = arrays.triangles;
  obstacle.friction = friction;
  return obstacle;
}

/// A sheet of size x size at z = 0.
inline testing::MeshArrays sheet(Scalar size, int cells) {
  return testing::plate_grid(size, size, cells, cells);
}

/// A device that is not turned.
inline DevicePose device_at(const Vector3& p_WD) {
  return DevicePose(RigidPose(p_WD));
}

inline constexpr Scalar kMillisecond = 1e-3;

}  // namespace dyop::testing
