// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "dyop/distance/nearest_triangle.h"
#include "dyop/distance/triangle_distance_batch.h"

namespace dyop::distance_internal {

/// triangle_distances() with a given instruction set, which this processor must support; for tests.
void triangle_distances(const TriangleBlocks& a, const TriangleBlocks& b, InstructionSet set,
                        TriangleDistanceBlocks& answers);

/// nearest_triangle(), likewise.
std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff,
                                                InstructionSet set);

}  // namespace dyop::distance_internal
