#pragma once

#include <optional>

#include "dyop/distance/triangle_block.h"
#include "dyop/distance/triangle_distance.h"

namespace DYOP_EXPORT dyop {

/// Answer of nearest_triangle().
struct NearestTriangle {
  int number = 0;             ///< in the block
  TriangleDistance distance;  ///< from a to it
};

/// Returns the triangle of a block that is nearest to another, if it is nearer than a cutoff: that
/// of the least `upper` below the cutoff, of equal ones the first. For leaves of hierarchies.
///
/// The same bits, on every processor, as comparing triangle_distance(a, n-th triangle) one by one.
///
/// @param count     Triangles in the block that are used, at most kTriangleBlockWidth.
/// @param direction A guess of the direction from a to the block, such as that of the nearest
/// points so far; of a length from 2^-64 to 2^64, else of no use. It decides the cost only:
/// triangles whose slab gap along it proves them farther than the cutoff are left out at once.
/// Cost: some nanoseconds for a block that is left out; else triangle_distance() for what is left,
/// several at once.
std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff);

}  // namespace dyop
