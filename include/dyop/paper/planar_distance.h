// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Distance of two convex sets in the plane. Points and normal are in the frame of the arguments.
struct PlanarDistance {
  Scalar lower = 0;               ///< never above the true distance; 0 if not proven positive
  Scalar upper = kInfinity;       ///< never below the true distance
  Vector2 p_a = Vector2::Zero();  ///< witness point on a, within rounding
  Vector2 p_b = Vector2::Zero();  ///< witness point on b, within rounding
  /// Unit vector from a to b whose slab gap min_b n.x - max_a n.x proves `lower`, if that is
  /// positive.
  Vector2 nhat_AB = Vector2::UnitX();
  Feature feature_a;  ///< Vertex or Edge with vertex numbers; Face (0, 1, 2) if a contains p_b
  Feature feature_b;
  bool is_overlapping = false;  ///< proven in exact arithmetic: they touch or intersect, upper is 0
};

/// Returns the distance of two triangles in the plane, with a certificate on both sides:
///     lower <= d <= upper,   upper - lower <= planar_noise(a, b),
/// d being the exact distance of the exact triangles. Vertices in any order; segments and points
/// are legal. The second inequality holds for sizes in [1e-100, 1e60].
///
/// Coordinates must be finite and at most kLargestCoordinate; they are not checked here.
/// Cost: about 20 scalar products; no allocation; bounded. See docs/algorithms/published_dyop.md.
PlanarDistance planar_triangle_distance(const PlanarTriangle& a, const PlanarTriangle& b);

/// The same for convex polygons, each in counterclockwise or clockwise order, with at least one
/// vertex; repeated and collinear vertices are legal. Convexity is not checked.
///
/// Coordinates as above. Cost: all pairs of a vertex and an edge; no allocation.
/// @throws InvalidArgument if a polygon has no vertex.
PlanarDistance convex_polygon_distance(std::span<const Vector2> a, std::span<const Vector2> b);

/// Allowance for rounding for this pair, a length: kTriangleNoise times the width plus height of
/// the box around both.
Scalar planar_noise(std::span<const Vector2> a, std::span<const Vector2> b);

}  // namespace dyop
