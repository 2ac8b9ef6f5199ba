// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/view/page_encoder.h"

namespace dyop::view_internal {

/// A pose at a time.
struct TimedPose {
  Scalar t = 0;
  RigidPose X_WB;
};

/// How far a body may be from its poses: its origin and any of its points.
struct ThinningLimits {
  Scalar tolerance = 0;  ///< length
  Scalar reach = 0;      ///< of the farthest point from the origin
};

/// Motions of constant twist through few of the poses, which pass all others within the limits.
/// Times must ascend; fewer than two poses give nothing.
void add_thinned(BodyId body, std::span<const TimedPose> poses, const ThinningLimits& limits,
                 std::vector<PageSegment>& segments);

}  // namespace dyop::view_internal
