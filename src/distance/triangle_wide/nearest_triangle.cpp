// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/nearest_triangle.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/tolerance.h"
#include "distance/triangle_wide/triangle_batch.h"
#include "distance/triangle_wide/triangle_block_access.h"
#include "distance/triangle_wide/triangle_wide.h"
#include "dyop/core/error.h"

namespace dyop {
namespace distance_internal {
namespace {

// From this number of triangles on, the wide kernel is faster than one call each.
constexpr int kFewest = 3;

TriangleSlab slab_of(const Triangle& a, const Vector3& direction, Scalar cutoff) {
  TriangleSlab slab;
  const Scalar squared = direction.squaredNorm();
  slab.start = 0;
  slab.largest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    const Vector3 edge = a[k] - a[0];
    slab.start = std::max(slab.start, direction.dot(edge));
    slab.largest = std::max(slab.largest, edge.cwiseAbs().maxCoeff());
  }
  for (int k = 0; k < 3; ++k) {
    slab.origin[k] = a[0][k];
    slab.direction[k] = direction[k];
  }
  slab.noise = kTriangleSlabNoise * direction.cwiseAbs().sum();
  // Directions so long or short that products leave the range prove nothing; nor does NaN.
  constexpr Scalar kLongest = kLargestTriangleSize * kLargestTriangleSize;
  const bool is_usable = squared <= kLongest && squared * kLongest >= 1;
  const Scalar underflow = 16 * std::numeric_limits<Scalar>::denorm_min();
  slab.limit =
      is_usable ? cutoff * std::sqrt(squared) * (1 + kTriangleSlabNoise) + underflow : kInfinity;
  return slab;
}

// Keeps the nearest of the triangles offered, in ascending order of numbers.
struct Nearest {
  std::optional<NearestTriangle> best;
  Scalar cutoff;

  void offer(int number, const TriangleDistance& d) {
    if (!(d.upper < cutoff)) return;
    cutoff = d.upper;
    best = {number, d};
  }
};

}  // namespace

std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff,
                                                InstructionSet set) {
  DYOP_REQUIRE(count >= 0 && count <= kTriangleBlockWidth, "a block of ", count, " triangles");
  const TriangleWideKernels& kernels = triangle_wide_kernels(set);
  unsigned left = kernels.slab(block, slab_of(a, direction, cutoff)) & ((1U << count) - 1);
  if (left == 0) return std::nullopt;
  TriangleBlock all_a;
  TriangleDistanceBlock answers;
  unsigned char decided = 0;
  if (std::popcount(left) >= kFewest) {
    for (std::size_t n = 0; n < kTriangleBlockWidth; ++n) set_triangle(all_a, n, a);
    kernels.quick(&all_a, &block, &answers, 1, triangle_constants(), &decided);
  }
  Nearest nearest{std::nullopt, cutoff};
  for (; left != 0; left &= left - 1) {
    const int number = std::countr_zero(left);
    const auto n = static_cast<std::size_t>(number);
    nearest.offer(number, (decided >> number & 1) != 0
                              ? answer_at(answers, n)
                              : triangle_distance(a, triangle_at(block, n)));
  }
  return nearest.best;
}

}  // namespace distance_internal

std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction,
                                                Scalar cutoff) {
  return distance_internal::nearest_triangle(a, block, count, direction, cutoff,
                                             core_internal::best_instruction_set());
}

}  // namespace dyop
