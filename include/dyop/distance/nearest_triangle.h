// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/distance/triangle_block.h"
#include "dyop/distance/triangle_distance.h"

namespace DYOP_EXPORT dyop {

/// Result of nearest_triangle().
struct NearestTriangle {
  int number = 0;             ///< index in the block
  TriangleDistance distance;  ///< from triangle a
};

/// Returns the triangle of a block nearest to triangle a, if it is nearer than a cutoff: the one
/// with the smallest `upper` below the cutoff, the first of equal ones. For leaves of hierarchies.
///
/// The same bits, on every processor, as comparing triangle_distance(a, n-th triangle) one by one.
///
/// @param count     Number of triangles in the block that are used, at most kTriangleBlockWidth.
/// @param direction A guess of the direction from a to the block, such as that of the nearest
///                  points so far; ignored unless its length is from 2^-64 to 2^64. It affects the
///                  cost only: triangles whose slab gap along it exceeds the cutoff are skipped at
///                  once.
/// Cost: a few nanoseconds for a block that is skipped; otherwise triangle_distance() for the
/// remaining triangles, several at once.
std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff);

}  // namespace dyop
