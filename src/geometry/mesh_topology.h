// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::geometry_internal {

// By triangle: a vertex number that stands for its connected part. Triangles are connected if they
// share a vertex number.
DYOP_EXPORT std::vector<std::int32_t> parts_of_triangles(
    std::size_t vertex_count, std::span<const TriangleIndices> triangles);

// One vertex number of each connected part, in the order of the triangles.
std::vector<std::int32_t> part_vertices(std::size_t vertex_count,
                                        std::span<const TriangleIndices> triangles);

}  // namespace dyop::geometry_internal
