// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/export.h"

// Triangles in blocks, so that several are loaded at once. No includes: the kernels that are
// compiled once per instruction set use this header.

namespace DYOP_EXPORT dyop {

/// Triangles per block, at most the SIMD width of any instruction set.
inline constexpr int kTriangleBlockWidth = 8;

/// Eight triangles: coordinate k of vertex v of number n is at[3 v + k][n].
struct alignas(64) TriangleBlock {
  double at[9][kTriangleBlockWidth];
};

/// Results of triangle_distance() for eight pairs, by member.
struct alignas(64) TriangleDistanceBlock {
  double lower[kTriangleBlockWidth];
  double upper[kTriangleBlockWidth];
  double p_a[3][kTriangleBlockWidth];
  double p_b[3][kTriangleBlockWidth];
  double nhat_AB[3][kTriangleBlockWidth];
  /// Features: 0..2 vertex, 3 + k edge from vertex k to k + 1, 6 face.
  unsigned char place_a[kTriangleBlockWidth];
  unsigned char place_b[kTriangleBlockWidth];
  unsigned char is_overlapping[kTriangleBlockWidth];  ///< 0 or 1
};

}  // namespace dyop
