// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/geometry/convex_shape.h"

namespace dyop::dynamics_internal {

/// Radius of the ball that inflates a convex shape's core; 0 for other shapes.
inline Scalar rounding_radius(const Shape& shape) {
  if (shape.kind() != ShapeKind::Convex) return 0;
  return static_cast<const ConvexShape&>(shape).rounding_radius();
}

}  // namespace dyop::dynamics_internal
