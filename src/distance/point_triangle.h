// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/triangle.h"
#include "dyop/geometry/shape.h"

namespace dyop::distance_internal {

/// The point of a triangle nearest to another point, with proven bounds on their distance.
struct PointTriangleDistance {
  Scalar lower = 0;
  Scalar upper = kInfinity;
  Vector3 p_C = Vector3::Zero();      ///< on the triangle, within rounding
  Vector3 nhat_C = Vector3::UnitX();  ///< unit, from the triangle to the point; proves `lower`
  Feature feature;                    ///< local vertex numbers 0, 1, 2
};

/// Certified as triangle_distance() with the point as a degenerate triangle, at a third of its
/// cost: the direction of [Ericson2005] 5.1.5 is tried first.
PointTriangleDistance point_triangle_distance(const Vector3& p, const Triangle& triangle);

}  // namespace dyop::distance_internal
