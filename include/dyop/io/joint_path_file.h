// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "dyop/chain/robot.h"

namespace DYOP_EXPORT dyop {

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
