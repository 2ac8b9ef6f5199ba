// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/convex_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "geometry/hull/quickhull.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/runnable_sets.h"

namespace dyop {
namespace {

using WideInteger = __int128_t;

std::vector<Vector3> integer_points(int count, int range, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<int> coordinate(-range, range);
  std::vector<Vector3> points;
  for (int k = 0; k < count; ++k) {
    const int x = coordinate(random);
    const int y = coordinate(random);
    points.emplace_back(x, y, coordinate(random));
  }
  return points;
}

// Sign of the volume of the tetrahedron a, b, c, d with integer coordinates, in integers.
int exact_side(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const auto difference = [](const Vector3& p, const Vector3& q) {
    return std::array<WideInteger, 3>{WideInteger(p.x()) - WideInteger(q.x()),
                                      WideInteger(p.y()) - WideInteger(q.y()),
                                      WideInteger(p.z()) - WideInteger(q.z())};
  };
  const auto [ux, uy, uz] = difference(b, a);
  const auto [vx, vy, vz] = difference(c, a);
  const auto [wx, wy, wz] = difference(d, a);
  const WideInteger det =
      (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz;
  return det > 0 ? 1 : det < 0 ? -1 : 0;
}

void expect_exact_hull(const std::vector<Vector3>& points) {
  const ConvexHull hull(points);
  ASSERT_EQ(hull.dimension(), 3);
  const TriangleMesh& surface = *hull.core_surface();
  EXPECT_TRUE(surface.is_closed());
  EXPECT_EQ(surface.triangles().size(), 2 * hull.vertices().size() - 4);  // Euler
  for (std::size_t k = 0; k < surface.triangles().size(); ++k) {
    const Triangle t = surface.triangle(std::int32_t(k));
    for (const Vector3& p : points) ASSERT_LE(exact_side(t[0], t[1], t[2], p), 0);
  }
}

// Small ranges are full of duplicates and of coplanar and collinear points.
TEST(ConvexHull, HasNoIntegerPointBeyondAnyFacet) {
  for (const int range : {1, 2, 3, 10, 1000, 1 << 20}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      expect_exact_hull(integer_points(300, range, seed));
    }
  }
}

// All within one part in 2^20 of a plane or of a line: the filter fails, the exact part decides.
TEST(ConvexHull, HasNoIntegerPointBeyondAnyFacetOfASliver) {
  std::vector<Vector3> flat = integer_points(300, 1 << 20, 1);
  std::vector<Vector3> thin = flat;
  for (Vector3& p : flat) p.z() = p.x() + p.y() + std::remainder(p.z(), 2.0);
  for (Vector3& p : thin) {
    p.y() = p.x() + std::remainder(p.y(), 3.0);
    p.z() = 3 * p.x() + std::remainder(p.z(), 3.0);
  }
  expect_exact_hull(flat);
  expect_exact_hull(thin);
}

TEST(ConvexHull, OfAGridOfACubeHasEightCorners) {
  std::vector<Vector3> points;
  for (int k = 0; k < 1000; ++k) points.emplace_back(k % 10, k / 10 % 10, k / 100);
  const ConvexHull hull(points);
  EXPECT_EQ(hull.vertices().size(), 8u);
  EXPECT_DOUBLE_EQ(hull.compute_mass_properties(1).mass, 729);
}

TEST(ConvexHull, SupportLosesNoExtremePointAtAnyScaleOrPlace) {
  std::mt19937_64 random(3);
  std::normal_distribution<Scalar> coordinate;
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    for (const Scalar offset : {0.0, 1e6}) {
      // A cylinder: flat ends, ties along its axis, thousands of vertices.
      std::vector<Vector3> points;
      for (int k = 0; k < 4000; ++k) {
        const Scalar angle = 2 * std::numbers::pi * (k / 2) / 2000;
        points.push_back(scale * Vector3(std::cos(angle), std::sin(angle), k % 2) +
                         Vector3::Constant(offset));
      }
      const ConvexHull hull(points);
      for (int k = 0; k < 300; ++k) {
        Vector3 n(coordinate(random), coordinate(random), coordinate(random));
        if (k < 100) n = k % 2 == 0 ? Vector3(0, 0, 1) : Vector3(n.x(), n.y(), 0);
        Scalar best = -kInfinity;
        for (const Vector3& p : points) best = std::max(best, n.dot(p));
        EXPECT_GE(n.dot(hull.core_support(n).point),
                  best - 8 * kUnitRoundoff * n.norm() * hull.bounding_radius());
      }
    }
  }
}

TEST(ConvexHull, OfCoplanarPointsIsAPolygon) {
  std::vector<Vector3> points = testing::plate_grid(2, 4, 8, 8).vertices;
  points.insert(points.end(), points.begin(), points.end());
  std::shuffle(points.begin(), points.end(), std::mt19937_64(5));
  for (Vector3& p : points) p = Vector3(p.x(), 2 * p.x() + p.y(), 3 + p.y());
  const ConvexHull hull(points);
  EXPECT_EQ(hull.dimension(), 2);
  EXPECT_EQ(hull.vertices().size(), 4u);
  EXPECT_EQ(hull.core_surface()->triangles().size(), 2u);
  EXPECT_THROW(hull.compute_mass_properties(1), InvalidArgument);
}

TEST(ConvexHull, OfCollinearPointsIsASegment) {
  std::vector<Vector3> points;
  for (int k = 0; k < 50; ++k) points.push_back(((k * 7) % 50 - 10.0) * Vector3(1, -2, 0));
  const ConvexHull hull(points);
  EXPECT_EQ(hull.dimension(), 1);
  ASSERT_EQ(hull.vertices().size(), 2u);
  EXPECT_EQ(hull.core_support(Vector3(1, 0, 0)).point, Vector3(39, -78, 0));
  EXPECT_EQ(hull.core_support(Vector3(-1, 0, 0)).point, Vector3(-10, 20, 0));
}

TEST(ConvexHull, OfOnePlaceIsAPoint) {
  const ConvexHull hull(std::vector<Vector3>(5, Vector3(1, 2, 3)));
  EXPECT_EQ(hull.dimension(), 0);
  EXPECT_EQ(hull.vertices().size(), 1u);
  EXPECT_EQ(hull.core_support(Vector3(-1, 0, 0)).point, Vector3(1, 2, 3));
}

TEST(ConvexHull, SurvivesARangeOfCoordinatesBeyondExactArithmetic) {
  std::vector<Vector3> points = integer_points(50, 5, 9);
  for (std::size_t k = 0; k < points.size(); ++k) points[k] *= std::pow(10.0, -4.0 * Scalar(k));
  points.push_back(Vector3(1e60, -1e60, 1e60));
  const ConvexHull hull(points);
  EXPECT_LE(hull.vertices().size(), points.size());
  EXPECT_EQ(hull.core_support(Vector3(1, 0, 0)).point, Vector3(1e60, -1e60, 1e60));
}

TEST(ConvexHull, RotatedCopiesHaveTheSameMass) {
  const ConvexHull hull(testing::gear(9, 0.7, 1, 0.5).vertices);
  const Matrix3 turn = rotation_from_vector(Vector3(1, 2, -0.5));
  const ConvexHull turned(testing::gear(9, 0.7, 1, 0.5).moved(turn, Vector3(1, 2, 3)).vertices);
  const MassProperties expected = hull.compute_mass_properties(1);
  const MassProperties found = turned.compute_mass_properties(1);
  EXPECT_NEAR(found.mass, expected.mass, 1e-13);
  EXPECT_LE((turn * expected.p_BoBcm + Vector3(1, 2, 3) - found.p_BoBcm).norm(), 1e-13);
  EXPECT_LE((turn * expected.I_BBcm * turn.transpose() - found.I_BBcm).norm(), 1e-13);
}

TEST(ConvexHull, CopesWithManyPointsOnASphere) {
  const ConvexHull hull(testing::icosphere(6).vertices);
  EXPECT_EQ(hull.vertices().size(), 40962u);
  EXPECT_TRUE(hull.core_surface()->is_closed());
}

TEST(ConvexHull, NamesTheBadPoint) {
  const auto message = [](std::vector<Vector3> points) {
    return testing::message_of([&] { ConvexHull{std::move(points)}; });
  };
  EXPECT_NE(message({}).find("not 0"), std::string::npos);
  const Scalar nan = std::nan("");
  EXPECT_NE(message({Vector3::Zero(), {1, nan, 2}}).find("point 1 is not finite"),
            std::string::npos);
  EXPECT_NE(message({Vector3(2e60, 0, 0)}).find("beyond 1e+60: (2e+60"), std::string::npos)
      << message({Vector3(2e60, 0, 0)});
}

// Blocks of eight, parts of 128, equal points: the first of the farthest, on every instruction set.
TEST(PointScan, FindsTheFirstFarthestPointOnEveryInstructionSet) {
  std::mt19937_64 random(4);
  for (const int count : {1, 2, 7, 8, 9, 31, 63, 64, 65, 127, 128, 129, 300}) {
    const std::vector<Vector3> points = integer_points(count, 3, std::uint64_t(count));
    for (const auto set : testing::runnable_sets()) {
      const geometry_internal::PointScan scan(points, set);
      for (int k = 0; k < 200; ++k) {
        const Vector3 d = k % 2 == 0 ? testing::random_direction(random)
                                     : Vector3(integer_points(1, 1, std::uint64_t(k))[0]);
        const auto along = [&](const Vector3& p) {
          return p.x() * d.x() + p.y() * d.y() + p.z() * d.z();
        };
        const auto first = std::max_element(
            points.begin(), points.end(),
            [&](const Vector3& p, const Vector3& q) { return along(p) < along(q); });
        ASSERT_EQ(scan.farthest(d), first - points.begin()) << count;
        ASSERT_EQ(scan.reach(d), along(*first));
      }
      const Vector3 no_direction(0, std::numeric_limits<Scalar>::quiet_NaN(), 0);
      EXPECT_EQ(scan.farthest(no_direction), 0);
      EXPECT_TRUE(std::isnan(scan.reach(no_direction)));
    }
  }
}

}  // namespace
}  // namespace dyop
