// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/paper/distance_algorithm.h"
#include "planar_pairs.h"

namespace dyop::testing {
namespace {

TEST(TextbookGjk, EdgesInSpaceMeetAtTheirCommonPerpendicular) {
  const Triangle a{Vector3(-1, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, -9)};
  const Triangle b{Vector3(0, -1, 1), Vector3(0, 1, 1), Vector3(0, 0, 9)};
  const GjkEstimate<3> d = textbook_gjk(a, b);
  EXPECT_NEAR(d.distance, 1, 1e-14);
  EXPECT_TRUE(d.p_a.isZero(1e-14));
  EXPECT_TRUE(d.p_b.isApprox(Vector3(0, 0, 1)));
  EXPECT_FALSE(d.is_overlapping);
}

TEST(TextbookGjk, VertexAboveAFace) {
  const Triangle a{Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(0, 2, 0)};
  const Triangle b{Vector3(0, 0, 0.5), Vector3(1, 0, 4), Vector3(-1, 0, 4)};
  EXPECT_NEAR(textbook_gjk(a, b).distance, 0.5, 1e-14);
}

TEST(TextbookGjk, SeesOverlapInThePlaneAndInSpace) {
  const PlanarTriangle flat{Vector2(0, 0), Vector2(2, 0), Vector2(0, 2)};
  const PlanarTriangle inside{Vector2(0.1, 0.1), Vector2(0.5, 0.1), Vector2(0.1, 0.5)};
  EXPECT_TRUE(textbook_gjk(flat, inside).is_overlapping);
  EXPECT_EQ(textbook_gjk(flat, inside).distance, 0);
  const Triangle a{Vector3(-1, -1, 0), Vector3(1, -1, 0), Vector3(0, 2, 0)};
  const Triangle b{Vector3(0.1, 0.2, -1), Vector3(0, 0, 1), Vector3(3, 0, 0.5)};
  EXPECT_TRUE(textbook_gjk(a, b).is_overlapping);
}

TEST(TextbookGjk, WitnessPointsAreAsFarApartAsItSays) {
  std::mt19937_64 random(31);
  for (int k = 0; k < 3000; ++k) {
    const TrianglePair pair = random_triangle_pair(TriangleFamily::Far, random);
    const GjkEstimate<3> d = textbook_gjk(pair.a, pair.b);
    EXPECT_NEAR((d.p_b - d.p_a).norm(), d.distance, 1e-12);
    const PlanarPair planar = random_planar_pair(PlanarFamily::Apart, 1, Vector2::Zero(), random);
    const GjkEstimate<2> e = textbook_gjk(planar.a, planar.b);
    EXPECT_NEAR((e.p_b - e.p_a).norm(), e.distance, 1e-12);
  }
}

TEST(TextbookGjk, EndsOnEveryFamily) {
  std::mt19937_64 random(32);
  for (const TriangleFamily family : kAllTriangleFamilies) {
    for (int k = 0; k < 500; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      EXPECT_LE(textbook_gjk(pair.a, pair.b).iterations, 32);
    }
  }
}

}  // namespace
}  // namespace dyop::testing
