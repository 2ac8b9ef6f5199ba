// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A second opinion: distance of two triangles by GJK with the public parts of libccd [Fiser]. An
/// estimate: nothing is proven. The planar version is the same in space with z = 0.
///
/// libccd tells whether shapes overlap and how deeply; it has no public distance call, and FCL
/// carries a copy of its private code for one. This adapter uses the public interface only:
/// libccd's support callbacks and its nearest points of a segment and a triangle to the origin, in
/// the loop that FCL runs after libccd's overlap test. Leaving that test out makes it faster, not
/// slower. Triangles that intersect give about zero.
///
/// Coordinates must be finite; they are not checked here. Bounded, no allocation.
Scalar libccd_distance(const Triangle& a, const Triangle& b);
Scalar libccd_distance(const PlanarTriangle& a, const PlanarTriangle& b);

}  // namespace dyop
