#pragma once

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// Answer of triangle_distance(). Points and normal are in the frame of the arguments.
struct TriangleDistance {
  Scalar lower = 0;               ///< never above the true distance; 0 if not proven positive
  Scalar upper = 0;               ///< never below the true distance
  Vector3 p_a = Vector3::Zero();  ///< witness point on a, within rounding
  Vector3 p_b = Vector3::Zero();  ///< witness point on b, within rounding
  /// Unit vector from a to b whose slab gap min_b n.x - max_a n.x proves `lower`; when lower is 0
  /// the best separating direction known, still unit.
  Vector3 normal = Vector3::UnitX();
  Feature feature_a;  ///< Vertex, Edge or Face with local vertex numbers 0, 1, 2
  Feature feature_b;
  bool is_crossing = false;  ///< the triangles were found to touch or intersect: upper is noise
};

/// Returns the distance of two triangles in one frame, with a certificate on both sides:
///     lower <= d <= upper,
/// d being the exact distance of the exact triangles with the given vertices. upper - lower is at
/// most triangle_noise(a, b) except where docs/algorithms/dyop.md says so.
///
/// Segments and points (repeated or collinear vertices) are legal. Coordinates must be finite and
/// at most kLargestCoordinate; they are not checked here.
///
/// Cost: about one clamped closest-point problem; no allocation; bounded.
/// Method: certified DyOP, docs/algorithms/dyop.md.
TriangleDistance triangle_distance(const Triangle& a, const Triangle& b);

/// Rounding allowance of triangle_distance() for this pair, a length (see docs/algorithms/dyop.md).
Scalar triangle_noise(const Triangle& a, const Triangle& b);

}  // namespace dyop
