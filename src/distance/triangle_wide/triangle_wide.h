// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/instruction_set.h"
#include "dyop/distance/triangle_block.h"

namespace dyop::distance_internal {

/// Constants of core/tolerance.h, which the kernels may not include.
struct TriangleConstants {
  double relative_slack;
  double size_slack;
  double noise;
  double smallest_size;
  double largest_size;
  double smallest_squared_direction;
  double smallest_facet_square;
  double largest_facet_square;
  double parallel_square;
  double flat_square;
  double contact_gap;
  double far_ratio;
};

/// Answers of triangle_distance(), bit for bit, for those pairs of some blocks that need only its
/// first stages.
///
/// @param decided One bit per pair of a block: whether its answer was found. The other pairs get
///                meaningless numbers.
using TriangleWideKernel = void (*)(const TriangleBlock* a, const TriangleBlock* b,
                                    TriangleDistanceBlock* answers, int block_count,
                                    const TriangleConstants& constants, unsigned char* decided);

/// A triangle, projected on a direction.
struct TriangleSlab {
  double origin[3];  ///< its vertex 0
  double direction[3];
  double start;    ///< largest product of the direction and a vertex from the origin
  double largest;  ///< coordinate of a vertex from the origin
  double noise;    ///< rounding of a product, over the largest coordinate
  double limit;    ///< cutoff times the length of the direction, rounded up
};

/// The triangles of a block, as bits, that the slab does not prove to be beyond the limit.
using TriangleSlabKernel = unsigned (*)(const TriangleBlock& block, const TriangleSlab& slab);

/// The kernels of an instruction set: `quick` decides pairs that need one candidate, `thorough`
/// also those that touch in a vertex, cross, or take a few steps.
struct TriangleWideKernels {
  TriangleWideKernel quick;
  TriangleWideKernel thorough;
  TriangleSlabKernel slab;
};

/// The kernels for an instruction set, which this processor must support.
const TriangleWideKernels& triangle_wide_kernels(InstructionSet set);

}  // namespace dyop::distance_internal
