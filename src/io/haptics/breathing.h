// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/haptics/haptic_runner.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// The key `breathing` of a tool scene (docs/formats.md): an obstacle that moves by a
/// formula, and is cut at given times.
/// @param vertices, triangles The obstacle at the start, in world.
/// @throws FileError naming the key that is missing, out of range or unknown.
TissueFeed read_breathing(const JsonNode& node, std::size_t obstacle,
                          const std::vector<Vector3>& vertices,
                          const std::vector<TriangleIndices>& triangles);

}  // namespace dyop::io_internal
