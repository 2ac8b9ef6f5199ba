// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "dyop/core/types.h"

/// The tests of [DyOP]: ten triangles, Obj1 to Obj10, each moved against the nine others until it
/// is at one fixed distance. The paper gives no coordinates, so the triangles are random, from a
/// seed.
namespace dyop::cli {

inline constexpr int kObjectCount = 10;
inline constexpr Scalar kPaperGap = 0.1;

template <int dimension>
using PaperPoint = Eigen::Matrix<Scalar, dimension, 1>;

template <int dimension>
using PaperTriangle = std::array<PaperPoint<dimension>, 3>;

template <int dimension>
struct PaperPair {
  PaperTriangle<dimension> a;  ///< the moved object
  PaperTriangle<dimension> b;
};

/// One of the 90 tests. Objects are numbered from 1, as in the paper.
template <int dimension>
struct PaperTest {
  int object = 1;
  int against = 2;
  PaperPair<dimension> pair;  ///< kPaperGap apart
  PaperPoint<dimension> away =
      PaperPoint<dimension>::UnitX();  ///< unit, from b to a: the direction from which a came
};

/// Vertices uniform in [-1, 1] along each axis.
template <int dimension>
PaperTriangle<dimension> random_paper_triangle(std::mt19937_64& random);

/// The 90 tests of ten such triangles; object i arrives along a random line through both centroids.
template <int dimension>
DYOP_EXPORT std::vector<PaperTest<dimension>> make_paper_tests(std::uint64_t seed);

/// The same pair as different input: rotated and shifted as a whole at random, each triangle's
/// vertices in random order. The distance stays the same; the boxes, and so what the pivot picks,
/// do not.
template <int dimension>
PaperPair<dimension> rotated_copy(const PaperPair<dimension>& pair, std::mt19937_64& random);

/// Moving steps: the object comes in from one unit farther away, turning by up to a radian about
/// its centroid, in equal steps that end at the test's own position; the whole path as in
/// rotated_copy().
template <int dimension>
void append_path(const PaperTest<dimension>& test, int steps, std::mt19937_64& random,
                 std::vector<PaperPair<dimension>>& pairs);

}  // namespace dyop::cli
