// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/triangle_oracle.h"

#include <CGAL/Gmpq.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/intersections.h>
#include <CGAL/squared_distance_3.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

// Rationals throughout: no filter that could fail with the rounding mode.
using ExactKernel = CGAL::Simple_cartesian<CGAL::Gmpq>;

void expect_distance(long double expected, const Triangle& a, const Triangle& b) {
  for (const OracleDistance& d : {oracle_triangle_distance(a, b), oracle_triangle_distance(b, a)}) {
    EXPECT_LE(d.lower(), expected);
    EXPECT_GE(d.upper(), expected);
    EXPECT_LE(d.error, 1e-18L * (1 + expected));
  }
}

Triangle point(const Vector3& p) {
  return {p, p, p};
}

Triangle segment(const Vector3& p, const Vector3& q) {
  return {p, q, q};
}

const Triangle kUnit{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};

TEST(TriangleOracle, MeasuresAVertexOverAFace) {
  expect_distance(2, kUnit, {Vector3(0.25, 0.25, 2), Vector3(5, 0, 7), Vector3(0, 5, 8)});
}

TEST(TriangleOracle, MeasuresTwoVertices) {
  // The nearest points are (1, 0, 0) and (2, -1, 1): all three steps are one.
  expect_distance(std::sqrt(3.0L), kUnit,
                  {Vector3(2, -1, 1), Vector3(9, -1, 1), Vector3(9, -3, 5)});
}

TEST(TriangleOracle, MeasuresTwoCrossedEdges) {
  // The edge on the x axis below an edge parallel to y at height 3.
  expect_distance(3, {Vector3(-1, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, -9)},
                  {Vector3(0, -1, 3), Vector3(0, 1, 3), Vector3(0, 0, 9)});
}

TEST(TriangleOracle, MeasuresPointsAndSegments) {
  expect_distance(std::sqrt(14.0L), point({0, 0, 0}), point({1, 2, 3}));
  // The point is 5 beside the line through the segment, which ends 12 before its foot.
  expect_distance(13, point({12, 5, 0}), segment({-4, 0, 0}, {0, 0, 0}));
  expect_distance(2, segment({-1, 0, 0}, {1, 0, 0}), segment({0, -1, 2}, {0, 1, 2}));
}

TEST(TriangleOracle, IsZeroWhereTrianglesMeet) {
  expect_distance(0, kUnit, {Vector3(0.2, 0.2, -1), Vector3(0.2, 0.2, 1), Vector3(3, 3, 0)});
  expect_distance(0, kUnit, kUnit);
  // Coplanar, one inside the other.
  expect_distance(0, kUnit, {Vector3(0.1, 0.1, 0), Vector3(0.2, 0.1, 0), Vector3(0.1, 0.2, 0)});
  expect_distance(0, kUnit, point({0.25, 0.5, 0}));
}

TEST(TriangleOracle, KeepsItsDigitsFarFromTheOriginAndAtAnySize) {
  const Triangle over{Vector3(0.25, 0.25, 2), Vector3(5, 0, 7), Vector3(0, 5, 8)};
  for (const Scalar size : {0x1p-300, 0x1p-20, 1.0, 0x1p20, 0x1p200}) {
    Triangle a = kUnit;
    Triangle b = over;
    for (Triangle* t : {&a, &b}) {
      for (Vector3& p : *t) p = size * (p + Vector3(0x1p30, -0x1p30, 0x1p30));
    }
    const OracleDistance d = oracle_triangle_distance(a, b);
    EXPECT_LE(std::abs(d.distance - 2.0L * static_cast<long double>(size)), d.error);
    EXPECT_LE(d.error, 1e-17L * static_cast<long double>(size));
  }
}

std::vector<Vector3> grid_of(const Triangle& t, int n) {
  std::vector<Vector3> points;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; i + j <= n; ++j) {
      const Scalar s = Scalar(i) / n;
      const Scalar u = Scalar(j) / n;
      points.push_back((1 - s - u) * t[0] + s * t[1] + u * t[2]);
    }
  }
  return points;
}

Scalar longest_edge(const Triangle& t) {
  return std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
}

// Every point of a triangle is within an edge length / n of a point of its grid, so that the grids
// come within that of the distance, and never below it.
TEST(TriangleOracle, IsTheLimitOfSampling) {
  constexpr int kGrid = 16;
  std::mt19937_64 random(1);
  for (const TriangleFamily family : kAllTriangleFamilies) {
    SCOPED_TRACE(name_of(family));
    for (int k = 0; k < 10; ++k) {
      const auto [a, b] = random_triangle_pair(family, random);
      Scalar sampled = kInfinity;
      for (const Vector3& p : grid_of(a, kGrid)) {
        for (const Vector3& q : grid_of(b, kGrid)) sampled = std::min(sampled, (p - q).norm());
      }
      const OracleDistance d = oracle_triangle_distance(a, b);
      const Scalar rounding = 1e-15 * (a[0].norm() + b[0].norm() + sampled);
      EXPECT_LE(d.lower(), static_cast<long double>(sampled + rounding));
      EXPECT_GE(d.upper() + static_cast<long double>((longest_edge(a) + longest_edge(b)) / kGrid +
                                                     rounding),
                static_cast<long double>(sampled));
    }
  }
}

ExactKernel::Triangle_3 exact(const Triangle& t) {
  const auto vertex = [](const Vector3& p) { return ExactKernel::Point_3(p.x(), p.y(), p.z()); };
  return {vertex(t[0]), vertex(t[1]), vertex(t[2])};
}

TEST(TriangleOracle, AgreesWithExactArithmeticOfCgal) {
  std::mt19937_64 random(2);
  int count = 0;
  for (const TriangleFamily family : kAllTriangleFamilies) {
    SCOPED_TRACE(name_of(family));
    for (int k = 0; k < 100; ++k) {
      const auto [a, b] = random_triangle_pair(family, random);
      const auto exact_a = exact(a);
      const auto exact_b = exact(b);
      // CGAL's triangles must have an area.
      if (exact_a.is_degenerate() || exact_b.is_degenerate()) continue;
      ++count;
      const OracleDistance d = oracle_triangle_distance(a, b);
      EXPECT_EQ(oracle_triangles_intersect(a, b), CGAL::do_intersect(exact_a, exact_b));
      // Compared as rationals: rounding the square first would hide half of the digits.
      const ExactKernel::FT squared = CGAL::squared_distance(exact_a, exact_b);
      const auto as_exact = [](long double x) {
        const auto high = static_cast<double>(x);
        return ExactKernel::FT(high) +
               ExactKernel::FT(static_cast<double>(x - static_cast<long double>(high)));
      };
      const ExactKernel::FT lower = as_exact(d.lower());
      const ExactKernel::FT upper = as_exact(d.upper());
      EXPECT_LE(lower * lower, squared);
      EXPECT_GE(upper * upper, squared);
    }
  }
  EXPECT_GT(count, 1200);
}

TEST(TriangleOracle, StatesAnErrorNearRoundingInEveryFamily) {
  std::mt19937_64 random(3);
  int repeated = 0;
  for (const TriangleFamily family : kAllTriangleFamilies) {
    SCOPED_TRACE(name_of(family));
    for (int k = 0; k < 100; ++k) {
      const auto [a, b] = random_triangle_pair(family, random);
      const OracleDistance d = oracle_triangle_distance(a, b);
      const auto size = static_cast<long double>(longest_edge(a) + longest_edge(b)) + d.distance;
      EXPECT_LE(d.error, 1e-27L * size + 2e-18L * d.distance);
      // What quad precision alone can prove contains what rational arithmetic finds.
      const OracleDistance wide = oracle_triangle_distance(to_points<Quad>(a), to_points<Quad>(b));
      EXPECT_LE(wide.lower(), d.upper());
      EXPECT_GE(wide.upper(), d.lower());
      if (wide.error > 2 * d.error) ++repeated;
    }
  }
  // The rational branch is reached.
  EXPECT_GT(repeated, 0);
}

TEST(TriangleOracle, DecidesIntersectionExactly) {
  const Triangle above{Vector3(0.25, 0.25, 0x1p-1000), Vector3(0, 1, 1), Vector3(1, 0, 1)};
  Triangle touching = above;
  touching[0].z() = 0;
  EXPECT_FALSE(oracle_triangles_intersect(kUnit, above));
  EXPECT_TRUE(oracle_triangles_intersect(kUnit, touching));
  EXPECT_TRUE(oracle_triangles_intersect(touching, kUnit));
}

TEST(RandomInputs, RepeatForTheSameSeed) {
  for (const TriangleFamily family : kAllTriangleFamilies) {
    std::mt19937_64 first(7);
    std::mt19937_64 second(7);
    const TrianglePair p = random_triangle_pair(family, first);
    const TrianglePair q = random_triangle_pair(family, second);
    EXPECT_EQ(p.a, q.a);
    EXPECT_EQ(p.b, q.b);
  }
}

// The share of pairs that meet is what tells the families apart.
TEST(RandomInputs, MeetAsOftenAsTheirNameSays) {
  std::mt19937_64 random(4);
  constexpr int kPairs = 80;
  for (const TriangleFamily family : kAllTriangleFamilies) {
    SCOPED_TRACE(name_of(family));
    int meeting = 0;
    for (int k = 0; k < kPairs; ++k) {
      const auto [a, b] = random_triangle_pair(family, random);
      if (oracle_triangles_intersect(a, b)) ++meeting;
    }
    switch (family) {
      case TriangleFamily::Far:
        EXPECT_EQ(meeting, 0);
        break;
      case TriangleFamily::Crossing:
      case TriangleFamily::SharedVertex:
      case TriangleFamily::SharedEdge:
      case TriangleFamily::Duplicate:
        EXPECT_EQ(meeting, kPairs);
        break;
      case TriangleFamily::NearlyCrossing:
      case TriangleFamily::CadTies:
      case TriangleFamily::Coplanar:
        EXPECT_GT(meeting, kPairs / 8);
        EXPECT_LT(meeting, kPairs - kPairs / 8);
        break;
      default:
        EXPECT_LT(meeting, kPairs);
        break;
    }
  }
}

}  // namespace
}  // namespace dyop::testing
