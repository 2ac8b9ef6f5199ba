// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

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

/// Reads a robot from a URDF file: links with their collision shapes, joints of all types, mimic
/// joints. Visual shapes are not read. See docs/robots.md.
///
/// A floating joint becomes three prismatic and three revolute ones, a planar joint two and one,
/// with names that end in /x, /y, /z, /roll, /pitch and /yaw.
/// @throws FileError naming file, line, element and value.
Robot load_robot(const std::filesystem::path& urdf, const RobotFileOptions& options = {});

/// The text of an SRDF file with one `disable_collisions` for each pair that is adjacent, always
/// touches or is proven never to. Pairs that can touch and undecided ones are named in comments.
/// @throws InvalidArgument if the robot has no such link.
std::string srdf_text(const Robot& robot, std::span<const LinkPairReport> pairs);

}  // namespace dyop
