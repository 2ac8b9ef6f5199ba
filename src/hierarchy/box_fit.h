// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/hierarchy/mesh_hierarchy.h"

namespace dyop::hierarchy_internal {

/// The box of a triangle, aligned with its longest edge and normal. Contains it as kBoxNoise says.
OrientedBox fit_triangle(const Triangle& triangle);

/// The smaller (by area) of the box along the principal axes of the vertices and the axis-aligned
/// one. At least one triangle. Contains them as kBoxNoise says, also if products of coordinates
/// under- or overflow.
OrientedBox fit_triangles(std::span<const Triangle> triangles);

/// About the size of that box, without its rounding: from a sample of many triangles.
Vector3 fitted_size(std::span<const Triangle> triangles);

}  // namespace dyop::hierarchy_internal
