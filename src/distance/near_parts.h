// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "distance/distance_traversal.h"
#include "dyop/core/export.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::distance_internal {

/// A child of each of two compounds; 0 for a shape that is none.
struct PartPair {
  std::int32_t a = 0;
  std::int32_t b = 0;
};

/// The pairs of children of two shapes that may be at most `reach` apart: all that are, in the order
/// of their numbers.
/// @param noise Allowance for rounding in a distance of the two shapes.
/// @param stack Memory that is kept by the caller.
/// @param pairs Gets them.
DYOP_EXPORT void find_near_parts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                 const RigidPose& X_WB, Scalar noise, Scalar reach,
                                 BoxPairStack& stack, std::vector<PartPair>& pairs);

}  // namespace dyop::distance_internal
