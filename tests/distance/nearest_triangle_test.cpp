// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "distance/triangle_wide/triangle_batch.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/random_inputs.h"
#include "support/runnable_sets.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using testing::TriangleFamily;

struct Leaf {
  Triangle a;
  std::vector<Triangle> triangles;
  TriangleBlock block = {};

  void add(const Triangle& triangle) {
    const std::size_t n = triangles.size();
    for (std::size_t k = 0; k < 9; ++k) {
      block.at[k][n] = triangle[k / 3][static_cast<Eigen::Index>(k % 3)];
    }
    triangles.push_back(triangle);
  }
};

// Up to eight triangles of pairs of a family whose first triangles are made to lie together.
Leaf random_leaf(TriangleFamily family, std::mt19937_64& random) {
  Leaf leaf;
  const auto [a, b] = testing::random_triangle_pair(family, random);
  leaf.a = a;
  leaf.add(b);
  const int count = 1 + testing::random_index(8, random);
  while (static_cast<int>(leaf.triangles.size()) < count) {
    const auto [other, triangle] = testing::random_triangle_pair(family, random);
    const Vector3 step = a[0] - other[0];
    leaf.add({triangle[0] + step, triangle[1] + step, triangle[2] + step});
  }
  return leaf;
}

std::optional<NearestTriangle> one_by_one(const Leaf& leaf, Scalar cutoff) {
  std::optional<NearestTriangle> best;
  for (std::size_t n = 0; n < leaf.triangles.size(); ++n) {
    const TriangleDistance d = triangle_distance(leaf.a, leaf.triangles[n]);
    if (!(d.upper < cutoff)) continue;
    cutoff = d.upper;
    best = {static_cast<int>(n), d};
  }
  return best;
}

TEST(NearestTriangle, HasTheBitsOfOneByOneForEveryCutoffAndDirection) {
  for (const TriangleFamily family : testing::kAllTriangleFamilies) {
    SCOPED_TRACE(testing::name_of(family));
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 600);
    for (int i = 0; i < 500; ++i) {
      const Leaf leaf = random_leaf(family, random);
      const int count = static_cast<int>(leaf.triangles.size());
      const TriangleDistance first = triangle_distance(leaf.a, leaf.triangles[0]);
      const Vector3 good =
          (leaf.triangles[0][0] - leaf.a[0]) * testing::random_magnitude(-3, 3, random);
      for (const Vector3& direction : {good, first.nhat_AB, testing::random_direction(random)}) {
        // At the distance itself, just above and below it, and elsewhere.
        for (const Scalar cutoff : {kInfinity, first.upper, std::nextafter(first.upper, kInfinity),
                                    first.upper * testing::random_number(0, 2, random), 0.0}) {
          const auto expected = one_by_one(leaf, cutoff);
          for (const auto set : testing::runnable_sets()) {
            const auto found = distance_internal::nearest_triangle(leaf.a, leaf.block, count,
                                                                   direction, cutoff, set);
            ASSERT_EQ(found.has_value(), expected.has_value());
            if (!found) continue;
            ASSERT_EQ(found->number, expected->number);
            ASSERT_TRUE(testing::has_same_bits(found->distance, expected->distance));
          }
        }
      }
    }
  }
}

// The triangles lie at z = 1 to 8 above a; with a cutoff of 3.5 three are left, and 2.5 is between.
TEST(NearestTriangle, FindsTheLowestOfAStack) {
  Leaf leaf;
  leaf.a = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
  for (const double z : {8, 2, 4, 3, 5, 6, 7, 9}) {
    leaf.add({Vector3(0.1, 0.1, z), Vector3(0.4, 0.1, z), Vector3(0.1, 0.4, z + 1)});
  }
  const auto nearest = nearest_triangle(leaf.a, leaf.block, 8, Vector3::UnitZ(), 3.5);
  ASSERT_TRUE(nearest.has_value());
  EXPECT_EQ(nearest->number, 1);
  EXPECT_LE(nearest->distance.lower, 2);
  EXPECT_GE(nearest->distance.upper, 2);
  EXPECT_FALSE(nearest_triangle(leaf.a, leaf.block, 8, Vector3::UnitZ(), 1.5).has_value());
  EXPECT_FALSE(nearest_triangle(leaf.a, leaf.block, 0, Vector3::UnitZ(), kInfinity).has_value());
  EXPECT_THROW(nearest_triangle(leaf.a, leaf.block, 9, Vector3::UnitZ(), 1), InvalidArgument);
}

}  // namespace
}  // namespace dyop
