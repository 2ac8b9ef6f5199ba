// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dyop/chain/robot.h"
#include "dyop/geometry/shape.h"
#include "dyop/toi/obstacle_set.h"

namespace DYOP_EXPORT dyop {

/// A collision object of a planning scene. One that holds planes is several with the same name:
/// its bounded parts, and a HalfSpace for each plane.
struct PlanningObject {
  std::string name;
  std::shared_ptr<const Shape> shape;
  RigidPose X_WO;
};

/// An object that a link of the robot holds.
struct HeldObject {
  std::string name;
  std::shared_ptr<const Shape> shape;
  std::string link;
  RigidPose X_LO;                        ///< in the frame of that link
  std::vector<std::string> touch_links;  ///< links that it may touch, besides its own
};

/// What stands around a robot, and the robot's state there.
struct PlanningScene {
  std::string name;
  std::vector<PlanningObject> objects;
  std::vector<HeldObject> held;
  /// Free coordinates of the robot; joints that the file does not name rest at zero, or at their
  /// limit nearest to it.
  JointVector state;
  /// Names of links and objects that may touch, by the matrix of allowed collisions. What it says
  /// of two links is not read: that is the robot's SRDF file.
  std::vector<std::pair<std::string, std::string>> allowed;

  /// The objects, in their order. Those that some link may touch are in a group of their own.
  ObstacleSet obstacles() const;
  /// The robot that holds what is held, and whose links ignore what they may touch among
  /// obstacles().
  /// @throws InvalidArgument as attach(); if a link or object of `allowed` is unknown, or objects
  ///         differ in more than 31 ways in which links may touch them.
  Robot place(const Robot& robot) const;
};

/// Reads a planning-scene message as MoveIt and its benchmarks write it, as YAML (.yaml, .yml) or
/// JSON. What is read, and what is refused: docs/robots.md.
/// @throws FileError naming file, key and value.
PlanningScene load_planning_scene(const std::filesystem::path& file, const Robot& robot);

/// Whether a JSON or YAML text is a planning scene, rather than a scene of this library: it has the
/// key `world` or `robot_state`. False if it cannot be parsed.
bool is_planning_scene(const std::filesystem::path& file);

}  // namespace dyop
