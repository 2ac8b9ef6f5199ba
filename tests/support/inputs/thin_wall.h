// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/toi/obstacle_set.h"

/// A piano and a wall with a slot, for planners.
namespace dyop::testing {

inline constexpr Scalar kWallThickness = 0.002;

/// A wall in the plane x = 0, two millimetres thick, 2 wide and 2 high, with a slot 0.08 wide and
/// 0.08 high in the middle; and a second wall, closed, at x = 0.9.
inline ObstacleSet thin_wall() {
  const Scalar half = kWallThickness / 2;
  const auto side = std::make_shared<Box>(Vector3(half, 0.48, 1));
  const auto cover = std::make_shared<Box>(Vector3(half, 0.04, 0.48));
  ObstacleSet set;
  set.add(side, RigidPose(Vector3(0, 0.52, 0)));
  set.add(side, RigidPose(Vector3(0, -0.52, 0)));
  set.add(cover, RigidPose(Vector3(0, 0, 0.52)));
  set.add(cover, RigidPose(Vector3(0, 0, -0.52)));
  set.add(std::make_shared<Box>(Vector3(half, 1, 1)), RigidPose(Vector3(0.9, 0, 0)));
  return set;
}

/// An L of two boxes, 0.03 long, 0.008 deep and 0.02 high.
inline std::shared_ptr<const Shape> piano() {
  return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {std::make_shared<Box>(Vector3(0.015, 0.004, 0.004)), RigidPose(Vector3(0, 0, -0.006))},
      {std::make_shared<Box>(Vector3(0.004, 0.004, 0.006)), RigidPose(Vector3(-0.011, 0, 0.004))}});
}

}  // namespace dyop::testing
