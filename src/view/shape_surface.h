// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "view/column_block.h"

namespace dyop::internal {

/// Triangles to draw.
struct ShapeSurface {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// The triangles of a mesh or polytope; for a smooth convex shape 8 * 4^fineness triangles between
/// support points; for a compound those of its children.
DYOP_EXPORT ShapeSurface surface_of(const Shape& shape, int fineness);

/// Adds columns <name>.vertices and <name>.triangles to a block and returns what the page needs to
/// decode them: vertices in order of first use, rounded to 1/65535 of their box, as differences.
nlohmann::json add_surface(ColumnBlock& block, const std::string& name,
                           const ShapeSurface& surface);

}  // namespace dyop::internal
