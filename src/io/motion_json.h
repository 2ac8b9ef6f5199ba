// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/core/rigid_pose.h"
#include "dyop/motion/motion.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// The objects "pose", "velocity" and "motion" of docs/formats.md.
DYOP_EXPORT RigidPose read_pose(const JsonNode& node);
DYOP_EXPORT Twist read_twist(const JsonNode& node);
DYOP_EXPORT std::shared_ptr<const Motion> read_motion(const JsonNode& node);

/// The object "motion" of docs/formats.md.
///
/// To add a motion: one entry in the table of motion_json.cpp.
/// @throws InvalidArgument for a motion that is not one of dyop's, or is made of user functions.
DYOP_EXPORT Json record_motion(const Motion& motion);

/// Throws FileError.
DYOP_EXPORT std::shared_ptr<const Motion> recorded_motion(const JsonNode& node);

}  // namespace dyop::io_internal
