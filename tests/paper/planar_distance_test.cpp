// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/planar_distance.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "planar_pairs.h"

namespace dyop::testing {
namespace {

const PlanarTriangle kUnit{Vector2(0, 0), Vector2(1, 0), Vector2(0, 1)};

PlanarTriangle moved(PlanarTriangle t, const Vector2& by) {
  for (Vector2& p : t) p += by;
  return t;
}

// Checks every promise of the header on one pair.
void expect_promises(const PlanarPair& pair, const PlanarDistance& d) {
  const OracleDistance truth = oracle_distance(pair);
  const Scalar noise = planar_noise(pair.a, pair.b);
  ASSERT_GE(d.lower, 0);
  ASSERT_LE(static_cast<long double>(d.lower), truth.upper());
  ASSERT_GE(static_cast<long double>(d.upper), truth.lower());
  ASSERT_LE(d.upper - d.lower, noise);
  ASSERT_NEAR(d.nhat_AB.norm(), 1, 8 * kUnitRoundoff);
  if (d.is_overlapping) {
    ASSERT_TRUE(oracle_intersect(pair));
    ASSERT_EQ(d.upper, 0);
  }
  Scalar largest = 0;
  for (const PlanarTriangle* t : {&pair.a, &pair.b}) {
    for (const Vector2& p : *t) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  const Scalar point_noise = noise + 8 * kUnitRoundoff * largest;
  ASSERT_NEAR((d.p_b - d.p_a).norm(), d.upper, 2 * point_noise);
  for (const auto& [p, t] : {std::pair(d.p_a, pair.a), std::pair(d.p_b, pair.b)}) {
    ASSERT_LE(oracle_distance({{p, p, p}, t}).lower(), static_cast<long double>(point_noise));
  }
}

TEST(PlanarDistance, VertexAboveAnEdge) {
  // The vertex (0.5, -2) of B is below the edge y = 0 of A.
  const PlanarTriangle b{Vector2(0.5, -2), Vector2(2, -4), Vector2(-1, -4)};
  const PlanarDistance d = planar_triangle_distance(kUnit, b);
  EXPECT_NEAR(d.upper, 2, planar_noise(kUnit, b));
  EXPECT_TRUE(d.p_a.isApprox(Vector2(0.5, 0)));
  EXPECT_EQ(d.p_b, b[0]);
  EXPECT_EQ(d.nhat_AB, Vector2(0, -1));
  EXPECT_EQ(d.feature_a, (Feature{FeatureKind::Edge, {0, 1}}));
  EXPECT_EQ(d.feature_b, (Feature{FeatureKind::Vertex, {0}}));
}

TEST(PlanarDistance, VertexBeyondAVertex) {
  // From the corner (1, 0) to (4, -4): 3, 4, 5.
  const PlanarTriangle b{Vector2(9, -4.5), Vector2(4, -4), Vector2(8, -7)};
  const PlanarDistance d = planar_triangle_distance(kUnit, b);
  EXPECT_NEAR(d.upper, 5, planar_noise(kUnit, b));
  EXPECT_TRUE(d.nhat_AB.isApprox(Vector2(0.6, -0.8)));
  EXPECT_EQ(d.feature_a, (Feature{FeatureKind::Vertex, {1}}));
  EXPECT_EQ(d.feature_b, (Feature{FeatureKind::Vertex, {1}}));
}

TEST(PlanarDistance, CrossingEdgesHaveNoDistanceAndTheirCommonPoint) {
  // The hypotenuse x + y = 1 and the line y = 0.25 meet at (0.75, 0.25).
  const PlanarTriangle b{Vector2(0.5, 0.25), Vector2(2, 0.25), Vector2(2, 0.5)};
  const PlanarDistance d = planar_triangle_distance(kUnit, b);
  EXPECT_TRUE(d.is_overlapping);
  EXPECT_EQ(d.lower, 0);
  EXPECT_EQ(d.upper, 0);
  EXPECT_TRUE(d.p_a == d.p_b);
  EXPECT_NEAR(d.p_a.sum(), 1, 4 * kUnitRoundoff);
}

TEST(PlanarDistance, AContainedTriangleIsCrossing) {
  const PlanarTriangle small{Vector2(0.2, 0.2), Vector2(0.3, 0.2), Vector2(0.2, 0.3)};
  const PlanarDistance inside = planar_triangle_distance(small, kUnit);
  EXPECT_TRUE(inside.is_overlapping);
  EXPECT_EQ(inside.feature_b.kind, FeatureKind::Face);
  EXPECT_TRUE(planar_triangle_distance(kUnit, small).is_overlapping);
}

TEST(PlanarDistance, TouchingIsCrossingExactly) {
  EXPECT_TRUE(planar_triangle_distance(kUnit, moved(kUnit, {1, 0})).is_overlapping);
  EXPECT_TRUE(planar_triangle_distance(kUnit, moved(kUnit, {0, -1})).is_overlapping);
  const Scalar above_one = std::nextafter(1.0, 2.0);
  EXPECT_FALSE(planar_triangle_distance(kUnit, moved(kUnit, {above_one, 0})).is_overlapping);
}

TEST(PlanarDistance, HoldsItsPromisesAtEveryScaleAndFarFromTheOrigin) {
  std::mt19937_64 random(7);
  const char* wanted = std::getenv("DYOP_PLANAR_PAIRS");  // a family
  const int pairs = wanted ? std::atoi(wanted) : 1200;
  int crossing = 0;
  Scalar widest = 0;
  for (const PlanarFamily family : kAllPlanarFamilies) {
    for (int k = 0; k < pairs; ++k) {
      const Scalar scale = random_magnitude(-4, 4, random);
      const Scalar offset =
          random_index(2, random) == 0 ? 0 : scale * random_magnitude(1, 6, random);
      const PlanarPair pair =
          random_planar_pair(family, scale, random_planar_vector(offset, random), random);
      const PlanarDistance d = planar_triangle_distance(pair.a, pair.b);
      expect_promises(pair, d);
      if (HasFatalFailure()) return;
      crossing += d.is_overlapping;
      widest = std::max(widest, (d.upper - d.lower) / planar_noise(pair.a, pair.b));
    }
  }
  const int checked = pairs * int(kAllPlanarFamilies.size());
  std::printf("%d pairs, %d crossing; widest bounds %.3f of planar_noise()\n", checked, crossing,
              widest);
  EXPECT_GT(crossing, checked / 5);
  EXPECT_LT(crossing, checked * 4 / 5);
}

TEST(PlanarDistance, PolygonRoutineAgreesWithTheTriangleRoutine) {
  std::mt19937_64 random(8);
  for (const PlanarFamily family : kAllPlanarFamilies) {
    for (int k = 0; k < 500; ++k) {
      const PlanarPair pair = random_planar_pair(family, 1, Vector2::Zero(), random);
      const PlanarDistance d = convex_polygon_distance(pair.a, pair.b);
      expect_promises(pair, d);
      if (HasFatalFailure()) return;
      EXPECT_EQ(d.is_overlapping, planar_triangle_distance(pair.a, pair.b).is_overlapping);
    }
  }
}

TEST(PlanarDistance, RegularPolygonsFaceEachOtherWithTheirCorners) {
  // 2n corners on circles of radius 1 about (0, 0) and (5, 0), one of each on the line between.
  for (const int half : {1, 2, 10, 200}) {
    std::vector<Vector2> a, b;
    for (int k = 0; k < 2 * half; ++k) {
      const Scalar angle = std::numbers::pi * k / half;
      a.emplace_back(std::cos(angle), std::sin(angle));
      b.emplace_back(5 + std::cos(angle), std::sin(angle));
    }
    const PlanarDistance d = convex_polygon_distance(a, b);
    EXPECT_NEAR(d.upper, 3, planar_noise(a, b)) << half;
    EXPECT_NEAR(d.lower, 3, planar_noise(a, b)) << half;
  }
}

TEST(PlanarDistance, APointIsAPolygon) {
  const std::vector<Vector2> a{Vector2(3, 4)};
  const std::vector<Vector2> b{Vector2(0, 0)};
  EXPECT_NEAR(convex_polygon_distance(a, b).lower, 5, planar_noise(a, b));
  EXPECT_TRUE(convex_polygon_distance(a, a).is_overlapping);
  EXPECT_THROW(convex_polygon_distance(a, {}), InvalidArgument);
}

TEST(PlanarDistance, BoundsHoldAtTheEdgesOfTheRange) {
  for (const Scalar scale : {1e-300, 1e-160, 1e-100, 1e59}) {  // literal: sizes under test
    PlanarPair pair{kUnit, {Vector2(4, 2), Vector2(5, 2), Vector2(4, 3)}};
    for (PlanarTriangle* t : {&pair.a, &pair.b}) {
      for (Vector2& p : *t) p *= scale;
    }
    const PlanarDistance d = planar_triangle_distance(pair.a, pair.b);
    // From (1, 0) to (4, 2).
    const Scalar truth = std::sqrt(Scalar{13}) * scale;
    EXPECT_LE(d.lower, truth) << scale;
    EXPECT_GE(d.upper, truth) << scale;
    EXPECT_LE(d.upper, 2 * truth) << scale;
    if (scale >= 1e-100) {  // literal: the range that the header promises
      EXPECT_LE(d.upper - d.lower, planar_noise(pair.a, pair.b)) << scale;
    }
  }
}

TEST(PlanarDistance, NanProvesNothing) {
  PlanarTriangle broken = moved(kUnit, {5, 0});
  broken[1].x() = std::nan("");
  for (const PlanarDistance& d :
       {planar_triangle_distance(kUnit, broken), planar_triangle_distance(broken, kUnit)}) {
    EXPECT_EQ(d.lower, 0);
    EXPECT_FALSE(d.is_overlapping);
  }
}

}  // namespace
}  // namespace dyop::testing
