// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "dyop/chain/robot.h"

namespace dyop::io_internal {

/// Free coordinates of a robot at rest: zero, or the limit nearest to it.
inline JointVector resting_state(const Robot& robot) {
  JointVector q(Eigen::Index(robot.free_count()));
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    const Joint& joint = robot.chain->joints()[robot.free_joints[k]];
    q[Eigen::Index(k)] = std::clamp<Scalar>(0, joint.lower, joint.upper);
  }
  return q;
}

/// The free coordinate of the joint of this name, if it has one of its own.
inline std::optional<Eigen::Index> free_index(const Robot& robot, const std::string& joint) {
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    if (robot.chain->joints()[robot.free_joints[k]].name == joint) return Eigen::Index(k);
  }
  return std::nullopt;
}

}  // namespace dyop::io_internal
