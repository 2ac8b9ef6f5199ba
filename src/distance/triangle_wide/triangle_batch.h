// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "distance/triangle/triangle_pair.h"
#include "distance/triangle_wide/triangle_wide.h"
#include "dyop/distance/triangle_block.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::distance_internal {

/// triangle_distances() with a given instruction set, which this processor must support; for tests.
void triangle_distances(const TriangleBlocks& a, const TriangleBlocks& b, InstructionSet set,
                        TriangleDistanceBlocks& answers);

/// nearest_triangle(), likewise.
std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff,
                                                InstructionSet set);

// Access to single triangles and answers in blocks.

inline Triangle triangle_at(const TriangleBlock& block, std::size_t n) {
  Triangle triangle;
  for (std::size_t v = 0; v < 3; ++v) {
    triangle[v] = Vector3(block.at[3 * v][n], block.at[3 * v + 1][n], block.at[3 * v + 2][n]);
  }
  return triangle;
}

inline void set_triangle(TriangleBlock& block, std::size_t n, const Triangle& triangle) {
  for (std::size_t k = 0; k < 9; ++k) {
    block.at[k][n] = triangle[k / 3][static_cast<Eigen::Index>(k % 3)];
  }
}

inline TriangleDistance answer_at(const TriangleDistanceBlock& d, std::size_t n) {
  return {d.lower[n],
          d.upper[n],
          Vector3(d.p_a[0][n], d.p_a[1][n], d.p_a[2][n]),
          Vector3(d.p_b[0][n], d.p_b[1][n], d.p_b[2][n]),
          Vector3(d.nhat_AB[0][n], d.nhat_AB[1][n], d.nhat_AB[2][n]),
          feature_of_place(d.place_a[n]),
          feature_of_place(d.place_b[n]),
          d.is_overlapping[n] != 0};
}

/// The constants of tolerance.h, for the kernels.
const TriangleConstants& triangle_constants();

}  // namespace dyop::distance_internal
