#pragma once

#include "dyop/core/triangle.h"
#include "dyop/geometry/shape.h"

namespace dyop::internal {

/// Local vertex numbers 0, 1, 2 of a triangle to those of its mesh.
inline Feature mesh_feature(Feature local, const TriangleIndices& indices) {
  for (std::int32_t& vertex : local.vertices) {
    if (vertex >= 0) vertex = indices[static_cast<std::size_t>(vertex)];
  }
  return local;
}

}  // namespace dyop::internal
