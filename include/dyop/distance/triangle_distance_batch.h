// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "dyop/distance/triangle_block.h"
#include "dyop/distance/triangle_distance.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
