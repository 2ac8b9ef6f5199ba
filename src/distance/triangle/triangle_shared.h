// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/simd_pair.h"
#include "dyop/distance/triangle_distance.h"

/// Triangles with common vertices, such as neighbours in a mesh: found by comparing coordinates, so
/// that the distance is zero without rounding.
namespace dyop::distance_internal {

/// Which vertices are equal: bit 3 i + j for vertex i of a and j of b.
inline unsigned equal_vertices(const Triangle& a, const Triangle& b) {
  LanePair row[3];
  LanePair column;
  LanePair corner;
  for (int k = 0; k < 3; ++k) {
    const LanePair b01(b[0][k], b[1][k]);
    const LanePair b22(b[2][k]);
    const LanePair next[5] = {equal(LanePair(a[0][k]), b01), equal(LanePair(a[1][k]), b01),
                              equal(LanePair(a[2][k]), b01), equal(LanePair(a[0][k], a[1][k]), b22),
                              equal(LanePair(a[2][k]), b22)};
    for (int i = 0; i < 3; ++i) row[i] = k == 0 ? next[i] : both(row[i], next[i]);
    column = k == 0 ? next[3] : both(column, next[3]);
    corner = k == 0 ? next[4] : both(corner, next[4]);
  }
  const auto mask = [](LanePair lanes) { return static_cast<unsigned>(bits(lanes)); };
  const unsigned of_b2 = mask(column);
  return mask(row[0]) | mask(row[1]) << 3 | mask(row[2]) << 6 | (of_b2 & 1) << 2 |
         (of_b2 & 2) << 4 | (mask(corner) & 1) << 8;
}

/// False only if no vertex is shared; a quick test of one coordinate.
inline bool may_share_vertex(const Triangle& a, const Triangle& b) {
  const LanePair b01(b[0].x(), b[1].x());
  const LanePair of_a0 = equal(LanePair(a[0].x()), b01);
  const LanePair of_a1 = equal(LanePair(a[1].x()), b01);
  const LanePair of_a2 = equal(LanePair(a[2].x()), b01);
  const LanePair of_b2 = equal(LanePair(b[2].x()), LanePair(a[0].x(), a[1].x()));
  const LanePair rest = equal(LanePair(b[2].x()), LanePair(a[2].x()));
  return bits(either(either(either(of_a0, of_a1), either(of_a2, of_b2)), rest)) != 0;
}

/// Unit normal of triangles that have a vertex in common, for a nonzero mask of equal_vertices():
/// that of the larger face at a common edge, else of the facet with the least depth. Zero if their
/// size is out of range or a coordinate is not finite.
Vector3 touching_normal(const Triangle& a, const Triangle& b, unsigned equal_mask);

}  // namespace dyop::distance_internal
