// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/triangle_distance.h"

#include <gtest/gtest.h>

#include "support/inputs/random_inputs.h"
#include "support/oracles/triangle_distance_check.h"

namespace dyop {
namespace {

const Triangle kUnit{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};

Triangle point(const Vector3& p) {
  return {p, p, p};
}

Triangle segment(const Vector3& p, const Vector3& q) {
  return {p, q, q};
}

Triangle scaled(Triangle triangle, Scalar factor) {
  for (Vector3& p : triangle) p *= factor;
  return triangle;
}

Feature vertex(std::int32_t i) {
  return {FeatureKind::Vertex, {i}};
}

Feature edge(std::int32_t i, std::int32_t j) {
  return {FeatureKind::Edge, {i, j}};
}

const Feature kFace{FeatureKind::Face, {0, 1, 2}};

/// What a pair with one nearest pair of points must give.
struct Nearest {
  Vector3 p_a;
  Vector3 p_b;
  Feature feature_a;
  Feature feature_b;
};

void expect_one_order(const Triangle& a, const Triangle& b, const Nearest& nearest) {
  const TriangleDistance d = triangle_distance(a, b);
  const Vector3 D = nearest.p_b - nearest.p_a;
  const Scalar noise = triangle_noise(a, b);
  EXPECT_LE(d.lower, D.norm());
  EXPECT_GE(d.upper, D.norm());
  EXPECT_LE(d.upper - d.lower, noise);
  EXPECT_LE((d.p_a - nearest.p_a).norm(), noise);
  EXPECT_LE((d.p_b - nearest.p_b).norm(), noise);
  EXPECT_LE((d.nhat_AB - D.normalized()).norm(), 1e-14);
  EXPECT_EQ(d.feature_a, nearest.feature_a);
  EXPECT_EQ(d.feature_b, nearest.feature_b);
  EXPECT_FALSE(d.is_overlapping);
}

/// Both orders, at sizes that are solved directly and at such that are scaled first. Powers of two:
/// the distance is exactly the closed form's times the factor.
void expect_nearest(const Triangle& a, const Triangle& b, const Nearest& nearest) {
  for (const int exponent : {-200, -65, -40, -13, 0, 13, 40, 65, 199}) {
    SCOPED_TRACE(exponent);
    const Scalar f = std::ldexp(1, exponent);
    const Vector3 p_a = f * nearest.p_a;
    const Vector3 p_b = f * nearest.p_b;
    expect_one_order(scaled(a, f), scaled(b, f), {p_a, p_b, nearest.feature_a, nearest.feature_b});
    expect_one_order(scaled(b, f), scaled(a, f), {p_b, p_a, nearest.feature_b, nearest.feature_a});
  }
}

void expect_touching(const Triangle& a, const Triangle& b) {
  for (const bool is_swapped : {false, true}) {
    const Triangle& first = is_swapped ? b : a;
    const Triangle& second = is_swapped ? a : b;
    const TriangleDistance d = triangle_distance(first, second);
    EXPECT_TRUE(d.is_overlapping);
    EXPECT_EQ(d.lower, 0);
    EXPECT_LE(d.upper, triangle_noise(first, second));
    EXPECT_EQ(testing::broken_bound(first, second, d, {}), nullptr);
    EXPECT_STREQ(testing::broken_witness(first, second, d), nullptr);
  }
}

// In these A ends at x = 1 with the vertex (1, 0, 0) and B begins at x = 2: the distance is 1.
TEST(TriangleDistance, MeasuresVertexToVertex) {
  const Triangle b{Vector3(2, 0, 0), Vector3(3, 1, 0.5), Vector3(3, -1, -0.5)};
  expect_nearest(kUnit, b, {{1, 0, 0}, {2, 0, 0}, vertex(1), vertex(0)});
}

TEST(TriangleDistance, MeasuresVertexToEdge) {
  const Triangle b{Vector3(4, 0, 0), Vector3(2, -1, -1), Vector3(2, 1, 1)};
  expect_nearest(kUnit, b, {{1, 0, 0}, {2, 0, 0}, vertex(1), edge(1, 2)});
}

TEST(TriangleDistance, MeasuresVertexToFace) {
  const Triangle b{Vector3(2, -1, -1), Vector3(2, 2, -1), Vector3(2, -1, 2)};
  expect_nearest(kUnit, b, {{1, 0, 0}, {2, 0, 0}, vertex(1), kFace});
}

// The edge of A along x lies at y = 0 and all of A above; B's edge along z lies at y = -1.
TEST(TriangleDistance, MeasuresEdgeToEdge) {
  const Triangle b{Vector3(0.5, -1, -1), Vector3(0.5, -1, 1), Vector3(0.5, -3, 0)};
  expect_nearest(kUnit, b, {{0.5, 0, 0}, {0.5, -1, 0}, edge(0, 1), edge(0, 1)});
}

// In the plane of A, opposite to its longest edge x + y = 1: the foot is (1, 1) / 2.
TEST(TriangleDistance, MeasuresACoplanarVertexToAnEdge) {
  const Triangle b{Vector3(1, 1, 0), Vector3(2, 1, 0), Vector3(1, 2, 0)};
  expect_nearest(kUnit, b, {{0.5, 0.5, 0}, {1, 1, 0}, edge(1, 2), vertex(0)});
}

TEST(TriangleDistance, MeasuresPointsAndSegments) {
  const Vector3 above(0.25, 0.25, 2);
  // |(2, 3, 6)| = 7.
  const Triangle origin = point(Vector3(0, 0, 0));
  const Triangle apart = point(Vector3(2, 3, 6));
  const TriangleDistance points = triangle_distance(origin, apart);
  EXPECT_LE(points.lower, 7);
  EXPECT_GE(points.upper, 7);
  EXPECT_LE(points.upper - points.lower, triangle_noise(origin, apart));
  const TriangleDistance face = triangle_distance(kUnit, point(above));
  EXPECT_EQ(face.feature_a, kFace);
  EXPECT_LE(face.lower, 2);
  EXPECT_GE(face.upper, 2);
  EXPECT_LE(face.upper - face.lower, triangle_noise(kUnit, point(above)));
  // Segments along x and y, 3 apart along z.
  const Triangle along_x = segment(Vector3(-1, 0, 0), Vector3(1, 0, 0));
  const Triangle along_y = segment(Vector3(0, -1, 3), Vector3(0, 1, 3));
  const TriangleDistance cross = triangle_distance(along_x, along_y);
  EXPECT_LE(cross.lower, 3);
  EXPECT_GE(cross.upper, 3);
  EXPECT_LE(cross.upper - cross.lower, triangle_noise(along_x, along_y));
}

// Parallel segments 0.5 apart that overlap in part: infinitely many nearest pairs, one distance.
TEST(TriangleDistance, MeasuresParallelSegments) {
  const Triangle a = segment(Vector3(0, 0, 0), Vector3(2, 0, 0));
  const Triangle b = segment(Vector3(5, 0.5, 0), Vector3(1, 0.5, 0));
  const TriangleDistance d = triangle_distance(a, b);
  EXPECT_LE(d.lower, 0.5);
  EXPECT_GE(d.upper, 0.5);
  EXPECT_LE(d.upper - d.lower, triangle_noise(a, b));
}

// Vertices on a line, the middle one first; the nearest point to (0, 1, 0) is the origin.
TEST(TriangleDistance, MeasuresCollinearVerticesInAnyOrder) {
  const Vector3 target(0, 1, 0);
  for (const Triangle& line : {Triangle{Vector3(1, 0, 0), Vector3(-3, 0, 0), Vector3(4, 0, 0)},
                               Triangle{Vector3(-3, 0, 0), Vector3(4, 0, 0), Vector3(1, 0, 0)}}) {
    const TriangleDistance d = triangle_distance(line, point(target));
    EXPECT_LE(d.lower, 1);
    EXPECT_GE(d.upper, 1);
    EXPECT_LE(d.upper - d.lower, triangle_noise(line, point(target)));
  }
}

TEST(TriangleDistance, FindsAnEdgeThroughAFace) {
  expect_touching(kUnit, {Vector3(0.25, 0.25, -1), Vector3(0.25, 0.25, 1), Vector3(3, 3, 0.5)});
}

TEST(TriangleDistance, FindsACoplanarOverlap) {
  expect_touching(kUnit, {Vector3(0.25, 0.25, 0), Vector3(2, 0.25, 0), Vector3(0.25, 2, 0)});
  // One inside the other: no edges meet.
  expect_touching(scaled(kUnit, 8), {Vector3(1, 1, 0), Vector3(2, 1, 0), Vector3(1, 2, 0)});
}

TEST(TriangleDistance, FindsAPointOnAFaceAndSegmentsThatCross) {
  expect_touching(kUnit, point(Vector3(0.25, 0.25, 0)));
  expect_touching(segment(Vector3(-1, 0, 0), Vector3(1, 0, 0)),
                  segment(Vector3(0, -1, 0), Vector3(0, 1, 0)));
  expect_touching(point(Vector3(1, 2, 3)), point(Vector3(1, 2, 3)));
}

// Vertices in common are compared exactly: no noise in the answer.
TEST(TriangleDistance, IsExactlyZeroForSharedVertices) {
  const Triangle fan{Vector3(1, 0, 0), Vector3(2, 1, 1), Vector3(2, -1, 1)};
  for (const Scalar factor : {1e-60, 1e-4, 1.0, 1e4, 1e60}) {
    const TriangleDistance d = triangle_distance(scaled(kUnit, factor), scaled(fan, factor));
    EXPECT_TRUE(d.is_overlapping);
    EXPECT_EQ(d.upper, 0);
    EXPECT_EQ(d.feature_a, vertex(1));
    EXPECT_EQ(d.feature_b, vertex(0));
  }
  const TriangleDistance same = triangle_distance(kUnit, kUnit);
  EXPECT_TRUE(same.is_overlapping);
  EXPECT_EQ(same.upper, 0);
}

// Each face lies on one side of the other's plane or in it, so that one of the planes separates.
TEST(TriangleDistance, SeparatesTrianglesWithACommonEdgeByAFace) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 2000; ++i) {
    const auto [a, b] = testing::random_triangle_pair(testing::TriangleFamily::SharedEdge, random);
    const TriangleDistance d = triangle_distance(a, b);
    ASSERT_TRUE(d.is_overlapping);
    ASSERT_EQ(d.upper, 0);
    ASSERT_NEAR(d.nhat_AB.norm(), 1, 8 * kUnitRoundoff);
    ASSERT_GE(testing::slab_gap(a, b, d.nhat_AB), testing::wide(-triangle_noise(a, b))) << i;
  }
  // Two faces of a cube that lies on another: the normal is that of the plane, not in it.
  const Triangle across{Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(1, 1, 0)};
  EXPECT_EQ(std::abs(triangle_distance(kUnit, across).nhat_AB.z()), 1);
}

TEST(TriangleDistance, KeepsItsBoundsAtTheEndsOfTheRange) {
  std::mt19937_64 random(7);
  for (const Scalar factor : {1e-300, 1e-160, 1e-60, 1e-20, 1e20, 1e60}) {
    for (int k = 0; k < 200; ++k) {
      testing::TrianglePair pair =
          testing::random_triangle_pair(testing::TriangleFamily::Near, random);
      pair = {scaled(pair.a, factor), scaled(pair.b, factor)};
      const TriangleDistance d = triangle_distance(pair.a, pair.b);
      const testing::OracleDistance truth = testing::oracle_triangle_distance(pair.a, pair.b);
      ASSERT_STREQ(testing::broken_bound(pair.a, pair.b, d, truth), nullptr) << factor << " " << k;
      ASSERT_TRUE(d.is_overlapping || d.upper - d.lower <= triangle_noise(pair.a, pair.b));
    }
  }
}

// In the smallest numbers a point at 3 steps from another; d = 3 steps exactly.
TEST(TriangleDistance, KeepsItsBoundsInTheSmallestNumbers) {
  constexpr Scalar kStep = std::numeric_limits<Scalar>::denorm_min();
  const Triangle a = point(Vector3(0, 0, 0));
  const Triangle b = point(Vector3(3 * kStep, 0, 0));
  const TriangleDistance d = triangle_distance(a, b);
  EXPECT_LE(d.lower, 3 * kStep);
  EXPECT_GE(d.upper, 3 * kStep);
  EXPECT_LE(d.upper - d.lower, triangle_noise(a, b));
}

// Scaling a huge pair down to one merges vertices that differ by 2^-1000: still not distance 0.
TEST(TriangleDistance, DoesNotMergeVerticesOfHugeTriangles) {
  const Scalar size = 0x1p199;
  const Scalar gap = 0x1p-1000;
  const Triangle a{Vector3(0, 0, 0), Vector3(-size, size, 0), Vector3(-size, 0, size)};
  const Triangle b{Vector3(gap, 0, 0), Vector3(size, size, 0), Vector3(size, 0, size)};
  const TriangleDistance d = triangle_distance(a, b);
  EXPECT_LE(d.lower, gap);
  EXPECT_GE(d.upper, gap);
}

TEST(TriangleDistance, ProvesNothingForNaNAndInfinity) {
  const Triangle apart{Vector3(5, 0, 0), Vector3(6, 1, 0), Vector3(6, 0, 1)};
  for (const Scalar bad : {std::nan(""), kInfinity, -kInfinity}) {
    for (int place = 0; place < 9; ++place) {
      Triangle broken = apart;
      broken[static_cast<std::size_t>(place / 3)][place % 3] = bad;
      for (const TriangleDistance& d :
           {triangle_distance(kUnit, broken), triangle_distance(broken, kUnit)}) {
        EXPECT_EQ(d.lower, 0);
        EXPECT_EQ(d.upper, kInfinity);
        EXPECT_FALSE(d.is_overlapping);
      }
    }
  }
}

TEST(TriangleDistance, KeepsItsPromisesInEveryFamily) {
  for (const testing::TriangleFamily family : testing::kAllTriangleFamilies) {
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 100);
    for (int i = 0; i < 300; ++i) {
      const testing::TrianglePair pair = testing::random_triangle_pair(family, random);
      const TriangleDistance d = triangle_distance(pair.a, pair.b);
      const testing::OracleDistance truth = testing::oracle_triangle_distance(pair.a, pair.b);
      ASSERT_STREQ(testing::broken_bound(pair.a, pair.b, d, truth), nullptr)
          << testing::name_of(family) << " " << i;
      ASSERT_STREQ(testing::broken_witness(pair.a, pair.b, d), nullptr)
          << testing::name_of(family) << " " << i;
    }
  }
}

TEST(TriangleDistance, HasBoundsAsTightAsDocumented) {
  for (const testing::TriangleFamily family : testing::kAllTriangleFamilies) {
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 200);
    for (int i = 0; i < 2000; ++i) {
      const testing::TrianglePair pair = testing::random_triangle_pair(family, random);
      const TriangleDistance d = triangle_distance(pair.a, pair.b);
      ASSERT_LE(d.upper - d.lower, triangle_noise(pair.a, pair.b))
          << testing::name_of(family) << " " << i;
    }
  }
}

TEST(TriangleDistance, IsSymmetricUpToNoise) {
  for (const testing::TriangleFamily family : testing::kAllTriangleFamilies) {
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 300);
    for (int i = 0; i < 1000; ++i) {
      const testing::TrianglePair pair = testing::random_triangle_pair(family, random);
      const TriangleDistance ab = triangle_distance(pair.a, pair.b);
      const TriangleDistance ba = triangle_distance(pair.b, pair.a);
      const Scalar noise = triangle_noise(pair.a, pair.b);
      ASSERT_LE(std::abs(ab.upper - ba.upper), noise) << testing::name_of(family) << " " << i;
      ASSERT_LE(std::abs(ab.lower - ba.lower), noise) << testing::name_of(family) << " " << i;
    }
  }
}

TEST(TriangleDistance, TellsCrossingFromApart) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 1000; ++i) {
    const auto crossing = testing::random_triangle_pair(testing::TriangleFamily::Crossing, random);
    ASSERT_TRUE(triangle_distance(crossing.a, crossing.b).is_overlapping) << i;
    const auto apart = testing::random_triangle_pair(testing::TriangleFamily::Far, random);
    ASSERT_FALSE(triangle_distance(apart.a, apart.b).is_overlapping) << i;
  }
}

}  // namespace
}  // namespace dyop
