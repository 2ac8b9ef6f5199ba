// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::geometry_internal {

// One vertex number of each connected part: triangles are connected if they share a vertex number.
std::vector<std::int32_t> part_vertices(std::size_t vertex_count,
                                        std::span<const TriangleIndices> triangles);

}  // namespace dyop::geometry_internal
