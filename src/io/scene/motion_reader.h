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

}  // namespace dyop::io_internal
