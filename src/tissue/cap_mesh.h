// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::tissue_internal {

/// A region of a plane between closed loops of points, which are counterclockwise around the region
/// and clockwise around its holes.
struct PlaneRegion {
  std::vector<Eigen::Vector2d> points;
  std::vector<std::vector<std::int32_t>> loops;
  /// It may be crumpled: loops may cross each other, and a hole in no loop bounds what is turned over.
  bool is_crumpled = false;
};

/// Triangulates a region by ear clipping [Meisters1975], improved by flips until it is Delaunay's
/// but for the loops [Lawson1977]. Points on the loops stay; points inside are added.
///
/// @param region  Out: with the added points at the end.
/// @param spacing Of the added points; 0: none.
/// @return Counterclockwise triangles. Where a loop crosses itself they lie over each other, some of
///         them perhaps clockwise. Nothing if a hole lies in no loop or crosses the one around it,
///         unless the region is crumpled.
std::optional<std::vector<TriangleIndices>> triangulate(PlaneRegion& region, Scalar spacing);

}  // namespace dyop::tissue_internal
