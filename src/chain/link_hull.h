// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::chain_internal {

/// Balls whose convex hull contains a shape, in the shape's frame.
struct LinkHull {
  std::vector<Vector3> centers;
  std::vector<Scalar> radii;  ///< of each ball, >= 0
};

LinkHull link_hull(const Shape& shape);

/// The largest distance of any point of a placed hull from the axis through `origin` along the unit
/// vector `axis`. The distance from a line is convex, so a corner attains it.
Scalar largest_radius(const LinkHull& hull, const RigidPose& X_CL, const Vector3& origin,
                      const Vector3& axis);

}  // namespace dyop::chain_internal
