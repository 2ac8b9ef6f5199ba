// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dyop/geometry/triangle_mesh.h"

namespace DYOP_EXPORT dyop {

/// Heights of ground above a rectangular grid in the xy plane.
struct HeightGrid {
  std::size_t rows = 0;              ///< along y, >= 2
  std::size_t columns = 0;           ///< along x, >= 2
  std::vector<Scalar> heights = {};  ///< z, row by row: heights[row * columns + column]
  Scalar x = 0;                      ///< of column 0
  Scalar y = 0;                      ///< of row 0
  Scalar spacing_x = 1;              ///< of columns, > 0
  Scalar spacing_y = 1;              ///< of rows, > 0
  /// Height of the bottom, below all heights. By default it is as far below the lowest height as
  /// the highest one is above that, or one spacing if that is more.
  std::optional<Scalar> base = std::nullopt;
};

/// Ground as a closed mesh: the surface through all heights, and a bottom and sides that close it.
/// So contains() and mass properties know its inside, while queries treat it as a surface like any
/// mesh. Vertex row * columns + column stands at that height. Each cell is two triangles that share
/// the diagonal from (column, row) to (column + 1, row + 1); they are triangles 2 k and 2 k + 1 of
/// cell k = row * (columns - 1) + column.
/// @throws InvalidArgument if there are fewer than two rows or columns, heights are not as many as
///         the grid has points or not finite, a spacing is not positive, the base is not below all
///         heights, or the mesh is larger than TriangleMesh allows.
TriangleMesh height_field(const HeightGrid& grid);

}  // namespace dyop
