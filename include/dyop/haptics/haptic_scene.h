// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"
#include "dyop/haptics/haptic_tick.h"
#include "dyop/haptics/virtual_coupling.h"

namespace DYOP_EXPORT dyop {

/// A jaw's hinge: the part turns about the z axis of a frame J fixed in the tool frame T.
struct ToolHinge {
  RigidPose X_TJ;
  Scalar angle = 0;  ///< at the start, radians
  /// Stiffness of the spring that pulls the jaw to the angle the device requests: torque per
  /// radian, > 0.
  Scalar stiffness = 0;
};

/// One body of the tool. Parts without a hinge are fixed to the tool frame T.
struct ToolPart {
  std::shared_ptr<const Shape> shape;
  RigidPose X_TP;  ///< its pose in the tool frame while its hinge is at angle 0
  std::optional<std::size_t> hinge = {};  ///< number among its tool's hinges
};

/// How the tool treats an obstacle.
enum class ObstacleRole {
  Tissue,      ///< touched: the tool stays out, with friction, and the hand feels it
  HardRegion,  ///< forbidden: the tool stays at least the margin away, without friction
  SoftRegion,  ///< a force that grows from the margin inwards, however deep, pushes back
  Monitor,     ///< only the clearance is reported
};

/// Something in the tool's surroundings: a rigid shape at rest, or a mesh that deforms.
struct ToolObstacle {
  std::string name;
  ObstacleRole role = ObstacleRole::Tissue;

  std::shared_ptr<const Shape> shape;  ///< rigid; or null:
  RigidPose X_WO;                      ///< pose of the shape
  std::vector<Vector3> vertices;       ///< of a deforming mesh at the start, world frame
  std::vector<TriangleIndices> triangles;

  /// Distance that the tool keeps (Tissue, HardRegion), from which it is pushed back (SoftRegion),
  /// or that counts as a breach (Monitor); length, >= 0.
  Scalar margin = 0;
  Scalar friction = 0;  ///< Coulomb's coefficient, >= 0; Tissue only
  /// Force per length inside the margin, towards the side where the tool came from, >= 0;
  /// SoftRegion only. A tool that starts within the margin is pushed by a force that grows from
  /// zero, as fast as HapticOptions::recovery_speed.
  Scalar soft_stiffness = 0;
};

/// A point that the shaft of the tool must pass, as in a trocar: the tool slides and turns through
/// it, and it turns about it. An ideal constraint of the tool's motion, which the hand feels; not
/// an obstacle.
struct ToolTrocar {
  Vector3 p_W = Vector3::Zero();      ///< the point
  Vector3 p_T = Vector3::Zero();      ///< a point of the shaft's axis, tool frame
  Vector3 axis_T = Vector3::UnitZ();  ///< along it; any length but zero
};

/// Largest number of tools of a session.
inline constexpr std::size_t kMostTools = 4;

/// A tool beside the first one of a scene, in another hand.
struct HapticTool {
  std::vector<ToolPart> parts;
  std::vector<ToolHinge> hinges;
  RigidPose X_WT;  ///< where it starts
  std::optional<ToolTrocar> trocar = {};
  /// Its springs; none: HapticOptions::coupling.
  std::optional<CouplingOptions> coupling = {};

  ToolPose start() const;
};

/// Everything a HapticSession needs. Any consistent units.
struct HapticScene {
  std::vector<ToolPart> tool;
  std::vector<ToolHinge> hinges;
  std::vector<ToolObstacle> obstacles;
  RigidPose X_WT;  ///< where the tool starts
  /// At the end of every tick the axis passes it by at most the rest offset; a tool that starts
  /// farther away is led there at HapticOptions::recovery_speed.
  std::optional<ToolTrocar> trocar = {};

  /// Further tools, at most kMostTools - 1. All tools move at once, and none may touch another:
  /// they push each other like hard obstacles that give way, so that two hands feel the same force.
  std::vector<HapticTool> more_tools = {};
  Scalar tool_margin = 0;    ///< distance that tools keep from each other, >= 0
  Scalar tool_friction = 0;  ///< Coulomb's coefficient between tools, >= 0

  /// All tools in their order, the first one included, which has no springs of its own.
  std::vector<HapticTool> tools() const;
};

}  // namespace dyop
