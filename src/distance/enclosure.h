// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::distance_internal {

/// Which of two shapes the caller declares to be solids.
struct Solids {
  bool a = false;
  bool b = false;
};

/// Throws InvalidArgument, prefixed with the name of the query, if a solid is a mesh that is not
/// closed.
void require_closed(const char* query, const Shape& a, const Shape& b, const Solids& solids);

/// For shapes whose surfaces do not meet: a point, in world, of a part of one that lies inside the
/// other, which must be a closed mesh declared solid; nothing if there is none.
std::optional<Vector3> find_enclosed_point(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                           const RigidPose& X_WB, const Solids& solids);

}  // namespace dyop::distance_internal
