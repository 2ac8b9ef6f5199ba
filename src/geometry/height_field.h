// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/geometry/height_field.h"

namespace dyop::geometry_internal {

struct HeightFieldArrays {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// What height_field() makes its mesh of.
/// @throws InvalidArgument as height_field(), except for what TriangleMesh refuses.
DYOP_EXPORT HeightFieldArrays height_field_arrays(const HeightGrid& grid);

}  // namespace dyop::geometry_internal
