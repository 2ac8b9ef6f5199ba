// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"
#include "dyop/distance/distance_result.h"

namespace DYOP_EXPORT dyop {

/// Result of triangle_distance(), in the frame of the arguments. Features have local vertex numbers
/// 0, 1, 2.
using TriangleDistance = NearestPoints;

/// Returns the distance of two triangles in one frame, with a certificate on both sides:
///     lower <= d <= upper,
/// where d is the exact distance of the exact triangles with the given vertices. upper - lower is
/// at most triangle_noise(a, b) except where docs/algorithms/dyop.md says so.
///
/// Segments and points (repeated or collinear vertices) are legal. Coordinates must be finite and
/// at most kLargestCoordinate; they are not checked here.
///
/// Cost: about one clamped closest-point problem; no allocation; bounded.
/// Method: certified DyOP, docs/algorithms/dyop.md.
TriangleDistance triangle_distance(const Triangle& a, const Triangle& b);

/// Allowance for rounding in triangle_distance() for this pair, a length (docs/algorithms/dyop.md).
Scalar triangle_noise(const Triangle& a, const Triangle& b);

/// Returns triangle_distance(a, b), trying first the features that were nearest at a nearby pose.
/// Same guarantees; the features affect only speed, and which of two equally near pairs is named.
///
/// @param last_a, last_b Features of the last result for this pair; arbitrary if there is none.
/// Cost: one clamped closest-point problem and its proof; if the proof fails, triangle_distance()
/// on top.
TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b);

}  // namespace dyop
