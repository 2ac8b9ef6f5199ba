// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "view/column_block.h"

namespace dyop::view_internal {

/// Triangles to draw.
struct ShapeSurface {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// The triangles of a mesh or polytope, and after them rods around segments and points, which could
/// not be seen; for a smooth convex shape 8 * 4^fineness triangles between
/// support points; for a compound those of its children; for a half-space a square plate.
/// @param plate Half the side of the plate.
DYOP_EXPORT ShapeSurface surface_of(const Shape& shape, int fineness, Scalar plate);

/// Half the side of the plate as which a half-space is drawn beside these shapes.
DYOP_EXPORT Scalar plate_beside(std::span<const Shape* const> shapes);

/// Shape::bounding_radius(), of a half-space that of its plate.
DYOP_EXPORT Scalar drawn_radius(const Shape& shape, Scalar plate);

/// The vertices that triangles use, in the order of their first use: the order of the page.
std::vector<std::int32_t> vertices_in_order(std::span<const TriangleIndices> triangles,
                                            std::size_t vertex_count);

/// Adds a column: three numbers for each row, x of all first, rounded to 1/65535 of their box, as
/// differences to the row before. The box is what the page needs to decode them.
AlignedBox add_rounded(ColumnBlock& block, const std::string& name,
                       std::span<const Vector3> vectors);

/// Adds columns <name>.vertices and <name>.triangles to a block and returns what the page needs to
/// decode them: vertices in order of first use, rounded to 2^-24 of their box, as differences.
nlohmann::json add_surface(ColumnBlock& block, const std::string& name,
                           const ShapeSurface& surface);

}  // namespace dyop::view_internal
