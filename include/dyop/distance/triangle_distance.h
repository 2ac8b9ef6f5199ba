// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/distance/distance_result.h"
#include "dyop/distance/triangle_block.h"

namespace DYOP_EXPORT dyop {

/// Result of triangle_distance(), in the frame of the arguments. Features have local vertex numbers
/// 0, 1, 2.
using TriangleDistance = NearestPoints;

/// Returns the distance of two triangles in one frame, with a certificate on both sides:
///     lower <= d <= upper,
/// where d is the exact distance of the exact triangles with the given vertices. upper - lower is
/// at most triangle_noise(a, b) except where docs/algorithms/dyop.md says so.
///
/// Segments and points (repeated or collinear vertices) are legal. Coordinates must be finite and
/// at most kLargestCoordinate; they are not checked here.
///
/// Cost: about one clamped closest-point problem; no allocation; bounded.
/// Method: certified DyOP, docs/algorithms/dyop.md.
TriangleDistance triangle_distance(const Triangle& a, const Triangle& b);

/// Allowance for rounding in triangle_distance() for this pair, a length (docs/algorithms/dyop.md).
Scalar triangle_noise(const Triangle& a, const Triangle& b);

/// Returns triangle_distance(a, b), trying first the features that were nearest at a nearby pose.
/// Same guarantees; the features affect only speed, and which of two equally near pairs is named.
///
/// @param last_a, last_b Features of the last result for this pair; arbitrary if there is none.
/// Cost: one clamped closest-point problem and its proof; if the proof fails, triangle_distance()
/// on top.
TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b);

/// Triangles stored in blocks. Unused slots of the last block hold zeros.
class TriangleBlocks {
 public:
  /// `count` triangles, all degenerate at the origin.
  explicit TriangleBlocks(std::size_t count = 0);

  std::size_t size() const { return count_; }
  std::span<const TriangleBlock> blocks() const { return blocks_; }

  /// @param n Less than size(), not checked.
  Triangle operator[](std::size_t n) const;
  void set(std::size_t n, const Triangle& triangle);

 private:
  std::size_t count_;
  std::vector<TriangleBlock> blocks_;
};

/// Results of triangle_distances(), stored likewise.
class TriangleDistanceBlocks {
 public:
  explicit TriangleDistanceBlocks(std::size_t count = 0) { resize(count); }

  std::size_t size() const { return count_; }
  void resize(std::size_t count);
  std::span<const TriangleDistanceBlock> blocks() const { return blocks_; }
  std::span<TriangleDistanceBlock> blocks() { return blocks_; }

  /// The result for pair n, as triangle_distance() gives it.
  /// @param n Less than size(), not checked.
  TriangleDistance operator[](std::size_t n) const;

 private:
  std::size_t count_ = 0;
  std::vector<TriangleDistanceBlock> blocks_;
};

/// Stores triangle_distance(a[n], b[n]) in answers[n] for every n: the same bits, on every
/// processor. `answers` gets the size of a and b.
///
/// @throws InvalidArgument if a and b differ in size.
/// Cost: as many pairs at once as the SIMD width (8 with AVX-512, 4 with AVX2, otherwise 2); pairs
/// that need more than a few steps are solved one by one. No allocation unless `answers` grows.
/// Method: docs/algorithms/dyop.md, "Many pairs at once".
void triangle_distances(const TriangleBlocks& a, const TriangleBlocks& b,
                        TriangleDistanceBlocks& answers);

/// Result of nearest_triangle().
struct NearestTriangle {
  int number = 0;             ///< index in the block
  TriangleDistance distance;  ///< from triangle a
};

/// Returns the triangle of a block nearest to triangle a, if it is nearer than a cutoff: the one
/// with the smallest `upper` below the cutoff, the first of equal ones. For leaves of hierarchies.
///
/// The same bits, on every processor, as comparing triangle_distance(a, n-th triangle) one by one.
///
/// @param count     Number of triangles in the block that are used, at most kTriangleBlockWidth.
/// @param direction A guess of the direction from a to the block, such as that of the nearest
///                  points so far; ignored unless its length is from 2^-64 to 2^64. It affects the
///                  cost only: triangles whose slab gap along it exceeds the cutoff are skipped at
///                  once.
/// Cost: a few nanoseconds for a block that is skipped; otherwise triangle_distance() for the
/// remaining triangles, several at once.
std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff);

}  // namespace dyop
