// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/published_dyop.h"

#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "planar_pairs.h"

namespace dyop::testing {
namespace {

// Boxes [0, 1] x [0, 1] and [3, 5] x [0.5, 2].
const PlanarTriangle kLeft{Vector2(0, 0), Vector2(1, 0), Vector2(0, 1)};
const PlanarTriangle kRight{Vector2(3, 0.5), Vector2(5, 0.5), Vector2(4, 2)};

TEST(PublishedDyop, InternalBoxLiesBetweenTheFacingExtremes) {
  const PublishedDyop<2> d = published_dyop(kLeft, kRight);
  EXPECT_EQ(d.box_a.max(), Vector2(1, 1));
  EXPECT_EQ(d.box_b.min(), Vector2(3, 0.5));
  EXPECT_EQ(d.axis, 0);
  // x: from the right side of the left box to the left side of the right one. y: the overlap.
  EXPECT_EQ(d.internal_box.min(), Vector2(1, 0.5));
  EXPECT_EQ(d.internal_box.max(), Vector2(3, 1));
  EXPECT_EQ(d.pivot, Vector2(2, 0.75));
}

TEST(PublishedDyop, PivotDoesNotDependOnTheOrder) {
  const PublishedDyop<2> d = published_dyop(kRight, kLeft);
  EXPECT_EQ(d.pivot, Vector2(2, 0.75));
  EXPECT_EQ(d.axis, 0);
}

TEST(PublishedDyop, KeepsTheTwoVerticesNearestToThePivot) {
  // Squared distances from (2, 0.75): left 4.5625, 1.5625, 4.0625; right 1.0625, 9.0625, 5.5625.
  const PublishedDyop<2> d = published_dyop(kLeft, kRight);
  EXPECT_EQ(d.kept_a, (std::array{1, 2}));
  EXPECT_EQ(d.kept_b, (std::array{0, 2}));
}

TEST(PublishedDyop, ShortestOfTheKeptWins) {
  // From (1, 0) to (3, 0.5), both vertices, with edges that lead away.
  const PublishedDyop<2> d = published_dyop(kLeft, kRight);
  EXPECT_DOUBLE_EQ(d.distance, std::sqrt(4.25));
  EXPECT_EQ(d.p_a, kLeft[1]);
  EXPECT_EQ(d.p_b, kRight[0]);
  EXPECT_EQ(d.feature_a, (Feature{FeatureKind::Vertex, {1}}));
  EXPECT_EQ(d.feature_b, (Feature{FeatureKind::Vertex, {0}}));
}

TEST(PublishedDyop, CrossingKeptEdgesHaveNoDistanceInThePlane) {
  // Edges from (0, 0) to (2, 2) and from (0, 2) to (2, 0) meet at (1, 1).
  const PlanarTriangle a{Vector2(0, 0), Vector2(2, 2), Vector2(-9, -8)};
  const PlanarTriangle b{Vector2(0, 2), Vector2(2, 0), Vector2(9, 9)};
  EXPECT_EQ(published_dyop(a, b).distance, 0);
}

TEST(PublishedDyop, EdgesInSpaceMeetAtTheirCommonPerpendicular) {
  // Along x at height 0, along y at height 1, with the third vertices far away.
  const Triangle a{Vector3(-1, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, -9)};
  const Triangle b{Vector3(0, -1, 1), Vector3(0, 1, 1), Vector3(0, 0, 9)};
  const PublishedDyop<3> d = published_dyop(a, b);
  EXPECT_EQ(d.axis, 2);
  EXPECT_DOUBLE_EQ(d.distance, 1);
  EXPECT_EQ(d.feature_a, (Feature{FeatureKind::Edge, {0, 1}}));
}

TEST(PublishedDyop, KnowsNoVertexAboveAFace) {
  // The tip (0, 0, 0.1) is 0.1 above the inside of the triangle; the paper's tests know only its
  // edges, the nearest of which is 1 away from the foot.
  const Triangle face{Vector3(-3, -1, 0), Vector3(3, -1, 0), Vector3(0, 4, 0)};
  const Triangle tip{Vector3(0, 0, 0.1), Vector3(1, 0, 5), Vector3(-1, 0, 5)};
  EXPECT_GT(published_dyop(face, tip).distance, 1);
}

TEST(PublishedDyop, HasTheSameAnswerInAPlaneInSpace) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 1000; ++k) {
    const PlanarPair pair = random_planar_pair(PlanarFamily::Apart, 1, Vector2::Zero(), random);
    const PublishedDyop<2> flat = published_dyop(pair.a, pair.b);
    const PublishedDyop<3> solid = published_dyop(in_space(pair.a), in_space(pair.b));
    EXPECT_EQ(flat.distance, solid.distance);
    EXPECT_EQ(flat.pivot, solid.pivot.head<2>());
  }
}

TEST(PublishedDyop, RepeatedVerticesAreSegmentsAndPoints) {
  const Triangle a{Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
  const Triangle b{Vector3(3, 4, 0), Vector3(3, 4, 0), Vector3(3, 4, 0)};
  EXPECT_DOUBLE_EQ(published_dyop(a, b).distance, 5);
}

// Its one guarantee, and that the segment is what it says.
template <int dimension, typename Pair>
void expect_over_estimate(const PublishedDyop<dimension>& d, const Pair& pair,
                          const OracleDistance& truth) {
  Scalar size = 0;
  for (const auto& p : pair.a) size = std::max(size, (p - pair.b[0]).norm());
  for (const auto& p : pair.b) size = std::max(size, (p - pair.a[0]).norm());
  Scalar largest = 0;
  for (const auto& p : pair.a) largest = std::max(largest, p.norm());
  const Scalar noise = 32 * kUnitRoundoff * size;
  ASSERT_GE(static_cast<long double>(d.distance + noise), truth.lower());
  ASSERT_NEAR((d.p_b - d.p_a).norm(), d.distance, noise + 8 * kUnitRoundoff * largest);
}

TEST(PublishedDyop, IsNeverBelowTheDistanceInThePlane) {
  std::mt19937_64 random(2);
  for (const PlanarFamily family : kAllPlanarFamilies) {
    for (int k = 0; k < 700; ++k) {
      const Scalar scale = random_magnitude(-4, 4, random);
      const Vector2 offset = random_planar_vector(1000 * scale, random);
      const PlanarPair pair = random_planar_pair(family, scale, offset, random);
      expect_over_estimate(published_dyop(pair.a, pair.b), pair, oracle_distance(pair));
      if (HasFatalFailure()) return;
    }
  }
}

TEST(PublishedDyop, IsNeverBelowTheDistanceInSpace) {
  std::mt19937_64 random(3);
  for (const TriangleFamily family :
       {TriangleFamily::Near, TriangleFamily::Far, TriangleFamily::DegenerateMix,
        TriangleFamily::CadTies, TriangleFamily::FarFromOrigin, TriangleFamily::Huge}) {
    for (int k = 0; k < 700; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      expect_over_estimate(published_dyop(pair.a, pair.b), pair,
                           oracle_triangle_distance(pair.a, pair.b));
      if (HasFatalFailure()) return;
    }
  }
}

}  // namespace
}  // namespace dyop::testing
