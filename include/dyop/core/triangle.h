// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Three vertices in some frame. Two or three of them may coincide or lie on a line: a segment and
/// a point are legal triangles.
using Triangle = std::array<Vector3, 3>;

/// A triangle in the plane, vertices in any order.
using PlanarTriangle = std::array<Vector2, 3>;

/// Vertex numbers of a triangle of a mesh; repeated numbers make a segment or a point.
using TriangleIndices = std::array<std::int32_t, 3>;

}  // namespace dyop
