// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::geometry_internal {

// The surface of a convex hull, with the input's point numbers.
struct HullSurface {
  int dimension = 0;
  // Dimension 3: closed, facing outwards. 2: a fan over the polygon. 1, 0: one triangle with
  // repeated numbers.
  std::vector<TriangleIndices> triangles;
};

// Convex hull of at least one finite point. Every point lies in the hull of those that the
// triangles use, exactly, except that coordinates below 2^-200 of the largest count as zero.
HullSurface quickhull(std::span<const Vector3> points);

}  // namespace dyop::geometry_internal
