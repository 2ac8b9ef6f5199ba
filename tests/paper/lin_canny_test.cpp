// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/lin_canny.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "planar_pairs.h"
#include "support/oracles/polytope_oracle.h"
#include "support/oracles/triangle_distance_check.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

std::vector<Vector3> box_corners(const Vector3& half) {
  return testing::make_box(half).points();
}

HullFeatures box_features(const Vector3& half) {
  return HullFeatures(ConvexHull(box_corners(half)));
}

TEST(HullFeatures, ACubeHasEighteenEdgesWithTwoFacesEach) {
  // Twelve of the cube and a diagonal in each of its six faces; V - E + F = 8 - 18 + 12 = 2.
  const HullFeatures cube = box_features({1, 1, 1});
  EXPECT_EQ(cube.edges().size(), 18u);
  std::size_t ends = 0;
  for (std::int32_t v = 0; v < 8; ++v) {
    for (const std::int32_t e : cube.edges_of_vertex(v)) {
      const auto& vertices = cube.edges()[std::size_t(e)].vertices;
      EXPECT_TRUE(vertices[0] == v || vertices[1] == v);
      ++ends;
    }
  }
  EXPECT_EQ(ends, 36u);
  for (const HullFeatures::Edge& edge : cube.edges()) {
    EXPECT_GE(edge.faces[0], 0);
    EXPECT_GE(edge.faces[1], 0);
  }
}

TEST(HullFeatures, EveryFaceNamesItsEdges) {
  const HullFeatures cube = box_features({1, 2, 3});
  const auto triangles = cube.hull().core_surface()->triangles();
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto& sides = cube.edges_of_face(std::int32_t(f));
    for (std::size_t k = 0; k < 3; ++k) {
      auto ends = cube.edges()[std::size_t(sides[k])].vertices;
      const std::int32_t from = triangles[f][k];
      const std::int32_t to = triangles[f][(k + 1) % 3];
      EXPECT_EQ(ends, (std::array{std::min(from, to), std::max(from, to)}));
    }
  }
}

TEST(HullFeatures, SegmentsAndPointsHaveNoFaces) {
  const HullFeatures segment{ConvexHull({Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(2, 0, 0)})};
  ASSERT_EQ(segment.edges().size(), 1u);
  EXPECT_EQ(segment.edges()[0].faces, (std::array{-1, -1}));
  const HullFeatures point{ConvexHull({Vector3(1, 2, 3)})};
  EXPECT_TRUE(point.edges().empty());
  EXPECT_TRUE(point.edges_of_vertex(0).empty());
}

TEST(LinCanny, BoxFaceToFaceEdgeAndVertex) {
  const HullFeatures box = box_features({1, 1, 1});
  // Side by side; a corner pair along (1, 1, 1); a vertex of the turned box above a face.
  const GjkResult faces = lin_canny_distance(box, box, RigidPose(Vector3(5, 0.5, 0.25)));
  EXPECT_NEAR(faces.upper, 3, 1e-13);
  const GjkResult corners = lin_canny_distance(box, box, RigidPose(Vector3(4, 4, 4)));
  EXPECT_NEAR(corners.upper, 2 * std::sqrt(3.0), 1e-13);
  EXPECT_EQ(corners.feature_a.kind, FeatureKind::Vertex);
  EXPECT_EQ(corners.feature_b.kind, FeatureKind::Vertex);
  // Turned by 45 degrees about z, the edge of B at x = 6 - sqrt 2 faces the side x = 1 of A.
  const Matrix3 R = rotation_from_vector(Vector3(0, 0, std::numbers::pi / 4));
  const GjkResult edge = lin_canny_distance(box, box, RigidPose(R, Vector3(6, 0, 0)));
  EXPECT_NEAR(edge.upper, 5 - std::numbers::sqrt2, 1e-13);
}

TEST(LinCanny, OverlapIsAnsweredByTheFallback) {
  const HullFeatures box = box_features({1, 1, 1});
  LinCannyCache cache;
  const GjkResult d = lin_canny_distance(box, box, RigidPose(Vector3(0.5, 0.25, 0)), &cache);
  EXPECT_TRUE(d.is_overlapping);
  EXPECT_EQ(d.lower, 0);
  EXPECT_FALSE(cache.is_certified);
}

TEST(LinCanny, HullsOfEveryDimensionAgreeWithTheOracle) {
  std::mt19937_64 random(21);
  for (int k = 0; k < 300; ++k) {
    const Scalar scale = random_magnitude(-4, 4, random);
    const auto points = [&] {
      const int dimension = random_index(4, random);
      std::vector<Vector3> result;
      const Vector3 center = random_vector(1, random);
      const Vector3 e = random_vector(1, random);
      const Vector3 f = random_vector(1, random);
      for (int i = 0; i < 4 + dimension; ++i) {
        const Scalar s = dimension > 0 ? random_number(-1, 1, random) : 0;
        const Scalar t = dimension > 1 ? random_number(-1, 1, random) : 0;
        Vector3 p = center + s * e + t * f;
        if (dimension == 3) p += random_vector(1, random);
        result.push_back(scale * p);
      }
      return result;
    };
    const std::vector<Vector3> points_a = points();
    const std::vector<Vector3> points_b = points();
    const RigidPose X_AB(random_rotation(random), 2 * scale * random_vector(1, random));
    const GjkResult d = lin_canny_distance(HullFeatures(ConvexHull(points_a)),
                                           HullFeatures(ConvexHull(points_b)), X_AB);
    const testing::PointHull a(points_a), b(points_b);
    const auto truth = testing::PolytopeOracle(a, b, X_AB).core_distance();
    const Scalar noise =
        kPoseNoise * (X_AB.translation().norm() + a.bounding_radius() + b.bounding_radius());
    ASSERT_LE(wide(d.lower), truth) << k;
    ASSERT_GE(wide(d.upper), truth) << k;
    ASSERT_LE(d.upper - d.lower, 4 * noise) << k;
    ASSERT_NEAR((d.p_b - d.p_a).norm(), d.upper, 3 * noise) << k;
  }
}

TEST(LinCanny, LargeHullsAgreeWithGjkAndTheWalkIsShort) {
  // Two spheres of 2000 points: too many for the oracle, so GJK's certificate is the judge.
  std::mt19937_64 random(22);
  std::vector<Vector3> points;
  for (int k = 0; k < 2000; ++k) points.push_back(random_direction(random));
  const HullFeatures ball{ConvexHull(points)};
  int certified = 0;
  for (int k = 0; k < 300; ++k) {
    const RigidPose X_AB(random_rotation(random),
                         random_number(2.01, 4, random) * random_direction(random));
    LinCannyCache cache;
    const GjkResult d = lin_canny_distance(ball, ball, X_AB, &cache);
    const GjkResult gjk = gjk_distance(ball.hull(), ball.hull(), X_AB);
    ASSERT_LE(d.lower, gjk.upper);
    ASSERT_GE(d.upper, gjk.lower);
    certified += cache.is_certified;
    EXPECT_LT(cache.steps, 100);
  }
  EXPECT_GE(certified, 297);
}

TEST(LinCanny, AWarmStartTakesOneStepAndChangesNothing) {
  std::mt19937_64 random(23);
  std::vector<Vector3> points;
  for (int k = 0; k < 200; ++k) points.push_back(random_direction(random));
  const HullFeatures ball{ConvexHull(points)};
  const RigidPose X_AB(random_rotation(random), Vector3(3, 1, 2));
  LinCannyCache cache;
  const GjkResult cold = lin_canny_distance(ball, ball, X_AB, &cache);
  const GjkResult warm = lin_canny_distance(ball, ball, X_AB, &cache);
  EXPECT_EQ(cache.steps, 1);
  EXPECT_NEAR(warm.lower, cold.lower, 1e-13);
  EXPECT_EQ(warm.feature_a, cold.feature_a);
}

TEST(LinCanny, EveryStartLeadsToTheSameDistance) {
  const Triangle a{Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(0, 2, 0)};
  const Triangle b{Vector3(0.5, 0.5, 1), Vector3(3, 3, 4), Vector3(-2, 3, 5)};
  using Place = LinCannyCache::Place;
  std::vector<Place> places{{FeatureKind::Face, 0}, {FeatureKind::Smooth, 0}};
  for (const FeatureKind kind : {FeatureKind::Vertex, FeatureKind::Edge}) {
    for (std::int32_t k = -1; k < 4; ++k) places.push_back({kind, k});
  }
  for (const Place& on_a : places) {
    for (const Place& on_b : places) {
      LinCannyCache cache{on_a, on_b};
      const TriangleDistance d = lin_canny_distance(a, b, &cache);
      EXPECT_NEAR(d.lower, 1, 3 * triangle_noise(a, b));
      EXPECT_EQ(d.feature_a.kind, FeatureKind::Face);
      EXPECT_EQ(d.feature_b, (Feature{FeatureKind::Vertex, {0}}));
      EXPECT_TRUE(cache.is_certified);
    }
  }
}

// Pairs a family; DYOP_LIN_CANNY_PAIRS sets another number.
int pairs_wanted(int few) {
  const char* wanted = std::getenv("DYOP_LIN_CANNY_PAIRS");
  return wanted ? std::atoi(wanted) : few;
}

TEST(LinCanny, TrianglesKeepTheBoundsInEveryFamily) {
  std::mt19937_64 random(24);
  const int pairs = pairs_wanted(700);
  int walked = 0;
  for (const TriangleFamily family : kAllTriangleFamilies) {
    int certified = 0;
    int most_steps = 0;
    int steps = 0;
    for (int k = 0; k < pairs; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      const OracleDistance truth = oracle_triangle_distance(pair.a, pair.b);
      LinCannyCache cache;
      const TriangleDistance d = lin_canny_distance(pair.a, pair.b, &cache);
      ASSERT_LE(wide(d.lower), truth.upper()) << name_of(family) << ' ' << k;
      ASSERT_GE(wide(d.upper), truth.lower()) << name_of(family) << ' ' << k;
      steps += cache.steps;
      most_steps = std::max(most_steps, cache.steps);
      if (!cache.is_certified) continue;
      ASSERT_LE(d.upper - d.lower, 3 * triangle_noise(pair.a, pair.b)) << name_of(family);
      ++certified;
    }
    walked += certified;
    std::printf("%-16s walk certified %6.2f %%, steps %.2f, at most %d\n", name_of(family),
                100.0 * certified / pairs, Scalar(steps) / pairs, most_steps);
  }
  EXPECT_GT(walked, pairs * int(kAllTriangleFamilies.size()) / 4);
}

TEST(LinCanny, StepsGrowSlowlyWithTheSizeOfTheHull) {
  // Two balls of n points roll past each other: cold steps grow like the walk from a support point,
  // warm ones hardly at all.
  std::mt19937_64 random(27);
  const int poses = pairs_wanted(100);
  for (const int count : {10, 100, 1000, 10000}) {
    std::vector<Vector3> points;
    for (int k = 0; k < count; ++k) points.push_back(random_direction(random));
    const HullFeatures ball{ConvexHull(points)};
    LinCannyCache warm;
    int cold_steps = 0;
    int warm_steps = 0;
    int certified = 0;
    for (int k = 0; k < poses; ++k) {
      const Scalar angle = 0.01 * k;
      const RigidPose X_AB(rotation_from_vector(Vector3(angle, 0.3, 0)),
                           2.5 * Vector3(std::cos(angle), std::sin(angle), 0.2));
      LinCannyCache cold;
      lin_canny_distance(ball, ball, X_AB, &cold);
      const GjkResult d = lin_canny_distance(ball, ball, X_AB, &warm);
      const GjkResult gjk = gjk_distance(ball.hull(), ball.hull(), X_AB);
      ASSERT_LE(d.lower, gjk.upper);
      ASSERT_GE(d.upper, gjk.lower);
      cold_steps += cold.steps;
      warm_steps += warm.steps;
      certified += warm.is_certified + cold.is_certified;
    }
    std::printf("%5d points: steps cold %.2f, warm %.2f, walk certified %.2f %%\n", count,
                Scalar(cold_steps) / poses, Scalar(warm_steps) / poses, 50.0 * certified / poses);
    EXPECT_LT(warm_steps, 12 * poses);
    EXPECT_GE(certified, 2 * poses * 98 / 100);
  }
}

TEST(LinCanny, ApartTrianglesAreSolvedByTheWalkItself) {
  std::mt19937_64 random(25);
  int walked = 0;
  constexpr int kPairs = 3000;
  for (int k = 0; k < kPairs; ++k) {
    const TrianglePair pair = random_triangle_pair(TriangleFamily::Far, random);
    LinCannyCache cache;
    lin_canny_distance(pair.a, pair.b, &cache);
    walked += cache.is_certified;
  }
  EXPECT_GE(walked, kPairs * 99 / 100);
}

TEST(LinCanny, PlanarTrianglesKeepTheBounds) {
  std::mt19937_64 random(26);
  for (const PlanarFamily family : kAllPlanarFamilies) {
    for (int k = 0; k < 700; ++k) {
      const Scalar scale = random_magnitude(-4, 4, random);
      const Vector2 offset = random_planar_vector(1000 * scale, random);
      const PlanarPair pair = random_planar_pair(family, scale, offset, random);
      const OracleDistance truth = oracle_distance(pair);
      const PlanarDistance d = lin_canny_distance(pair.a, pair.b);
      ASSERT_LE(wide(d.lower), truth.upper());
      ASSERT_GE(wide(d.upper), truth.lower());
      ASSERT_LE(d.upper - d.lower, planar_noise(pair.a, pair.b));
    }
  }
}

TEST(LinCanny, PolygonsOfManyCornersNeedFewStepsWhenWarm) {
  // Ellipses with 400 corners; B goes round A, a degree at a time.
  std::vector<Vector2> a, b;
  for (int k = 0; k < 400; ++k) {
    const Scalar angle = 2 * std::numbers::pi * k / 400;
    a.emplace_back(2 * std::cos(angle), std::sin(angle));
  }
  LinCannyCache cache;
  int steps = 0;
  for (int degree = 0; degree < 360; ++degree) {
    const Scalar angle = std::numbers::pi * degree / 180;
    b.clear();
    for (const Vector2& p : a) {
      b.push_back(0.5 * p + 4 * Vector2(std::cos(angle), std::sin(angle)));
    }
    const PlanarDistance d = lin_canny_distance(a, b, &cache);
    const PlanarDistance brute = convex_polygon_distance(a, b);
    ASSERT_LE(d.lower, brute.upper);
    ASSERT_GE(d.upper, brute.lower);
    ASSERT_TRUE(cache.is_certified);
    if (degree > 0) steps += cache.steps;
  }
  EXPECT_LT(steps, 360 * 12);
  EXPECT_THROW(lin_canny_distance(a, {}), InvalidArgument);
}

TEST(LinCanny, NanProvesNothing) {
  Triangle a{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
  Triangle b = a;
  for (Vector3& p : b) p.z() += 3;
  b[1].y() = std::nan("");
  EXPECT_EQ(lin_canny_distance(a, b).lower, 0);
  EXPECT_EQ(lin_canny_distance(b, a).lower, 0);
}

// The foot of b's vertex along the normal of a face 1e12 long is beside that face, as the normal is
// only good to 1e-4: it once made the upper bound 31, below the distance of 37.48.
TEST(LinCanny, TakesNoWitnessBesideAThinFace) {
  const Triangle a{Vector3(1e12, 1e12, 0), Vector3(-1, 0, 0), Vector3(4.75, 1000, 1000)};
  const Triangle b{Vector3(0, 0, 96), Vector3(0, 0, 53), Vector3(1000, 1000, 1000)};
  const OracleDistance truth = oracle_triangle_distance(a, b);
  for (const TriangleDistance& d : {lin_canny_distance(a, b), lin_canny_distance(b, a)}) {
    EXPECT_LE(wide(d.lower), truth.upper());
    EXPECT_GE(wide(d.upper), truth.lower());
  }
}

}  // namespace
}  // namespace dyop::testing
