// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"

namespace dyop::io_internal {

/// Largest number of corners of a polygon that is not strictly convex: ear clipping is quadratic at
/// best.
inline constexpr std::size_t kMostConcaveCorners = 4096;

/// Appends the triangles of a polygon: for n ≥ 3 corners n − 2 triangles, oriented like the
/// polygon, on its corners only, so that neighbours along its edges stay neighbours.
///
/// A strictly convex polygon becomes a fan around its first corner. From any other, ears are cut
/// (Meisters, "Polygons have ears", 1975) in the plane of its vector area; if no ear can be found,
/// as in a polygon that crosses itself, the rest becomes a fan. Two corners give the triangle a, b,
/// b, one corner a, a, a.
/// @throws InvalidArgument for a polygon of more than kMostConcaveCorners corners that is not
///         strictly convex.
void append_triangles(const std::vector<Vector3>& vertices, std::span<const std::int32_t> polygon,
                      std::vector<TriangleIndices>& triangles);

}  // namespace dyop::io_internal
