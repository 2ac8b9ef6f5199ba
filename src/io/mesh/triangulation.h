// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"

namespace dyop::internal {

/// The most corners of a polygon that is not strictly convex: cutting ears is of second order at best.
inline constexpr std::size_t kMostConcaveCorners = 4096;

/// Appends the triangles of a polygon: of n ≥ 3 corners n − 2 triangles, turning as the polygon
/// does, on its corners only, so that neighbours along its edges stay neighbours.
///
/// A strictly convex polygon becomes the fan of its first corner. From any other, ears are cut (Meisters,
/// "Polygons have ears", 1975) in the plane of its vector area; what is left when no ear can be
/// found, as in a polygon that crosses itself, becomes a fan. Two corners give the triangle a, b, b,
/// one corner a, a, a.
/// @throws InvalidArgument for a polygon of more than kMostConcaveCorners that is not so.
void append_triangles(const std::vector<Vector3>& vertices, std::span<const std::int32_t> polygon,
                      std::vector<TriangleIndices>& triangles);

}  // namespace dyop::internal
