// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dyop/chain/kinematic_chain.h"
#include "dyop/chain/link_pairs.h"
#include "dyop/chain/robot.h"

namespace DYOP_EXPORT dyop {

/// How a robot's root link is held.
enum class RobotBase { Fixed, Planar, Floating };

struct RobotFileOptions {
  /// The SRDF file that belongs to the robot; empty: none.
  std::filesystem::path srdf = {};
  /// Where to search for `package://NAME/PATH`, as NAME/PATH and as PATH, and for relative paths.
  /// The file's own folder and the folders above it are searched too.
  std::vector<std::filesystem::path> package_paths = {};
  RobotBase base = RobotBase::Fixed;
  /// Leave out of self-collision the pairs too that the SRDF file exempts for the reason `Never`:
  /// a claim, mostly drawn from samples, that decide_link_pairs() may refute. Pairs with other
  /// reasons are always left out.
  bool trusts_never = false;
};

/// Reads a robot from a URDF file, or from a model in MuJoCo's format MJCF: links with their
/// collision shapes, joints of all types, mimic joints. Visual shapes are not read. See
/// docs/robots.md.
///
/// A floating joint becomes three prismatic and three revolute ones, a ball joint three revolute
/// ones, a planar joint two and one, with names that end in /x, /y, /z, /yaw, /pitch and /roll.
/// @throws FileError naming file, line, element and value.
Robot load_robot(const std::filesystem::path& file, const RobotFileOptions& options = {});

/// The text of an SRDF file with one `disable_collisions` for each pair that is adjacent, always
/// touches or is proven never to. Pairs that can touch and undecided ones are named in comments.
/// @throws InvalidArgument if the robot has no such link.
std::string srdf_text(const Robot& robot, std::span<const LinkPairReport> pairs);

/// Returns the chain of a JSON file, as described in docs/algorithms/chain.md, "Files". Mesh files
/// are looked for beside it.
/// @throws FileError naming the file and the key.
KinematicChain load_chain(const std::filesystem::path& file);

/// What runs through the waypoints of a file.
enum class PathInterpolation {
  Linear,  ///< straight lines
  Cubic,   ///< cubics with the file's velocities; without any, the spline that starts at rest
  Quintic  ///< quintics with the file's velocities and accelerations, which it must have
};

/// Returns the path of a robot's free coordinates from a CSV file, a joint-trajectory message as
/// JSON or YAML (the name ends in .json, .yaml or .yml), or a message that holds one. Joints that
/// the file does not name rest where `rest` says, one number per free coordinate; without it at
/// zero, or at their limit nearest to it. Format: docs/robots.md.
/// @throws FileError naming file, line or key, and value.
JointPath load_joint_path(const std::filesystem::path& file, const Robot& robot,
                          PathInterpolation interpolation = PathInterpolation::Linear,
                          const std::optional<JointVector>& rest = {});

}  // namespace dyop
