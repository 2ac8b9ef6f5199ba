#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/triangle.h"

namespace dyop::internal {

// Every edge is used exactly twice, once in each direction; triangles that repeat a vertex number
// do not count, and there are others.
bool is_closed_surface(std::span<const TriangleIndices> triangles);

// One vertex number of each connected part: triangles are connected if they share a vertex number.
std::vector<std::int32_t> part_vertices(std::size_t vertex_count,
                                        std::span<const TriangleIndices> triangles);

}  // namespace dyop::internal
