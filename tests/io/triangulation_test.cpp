// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "dyop/core/error.h"
#include "io/mesh/mesh_reader.h"
#include "support/inputs/random_inputs.h"

namespace dyop::io_internal {
namespace {

std::vector<std::int32_t> all_corners(std::size_t count) {
  std::vector<std::int32_t> corners(count);
  std::iota(corners.begin(), corners.end(), 0);
  return corners;
}

std::vector<TriangleIndices> triangles_of(const std::vector<Vector3>& polygon) {
  std::vector<TriangleIndices> triangles;
  append_triangles(polygon, all_corners(polygon.size()), triangles);
  return triangles;
}

Vector3 area_of(const std::vector<Vector3>& p, std::size_t i, std::size_t j, std::size_t k) {
  return (p[j] - p[i]).cross(p[k] - p[i]) / 2;
}

// A triangulation of a plane polygon is one if n - 2 triangles turn as it does and their areas add
// up to its area: then none overlaps another or leaves the polygon. Its edges once each way inside,
// once along the rim.
void expect_triangulation(const std::vector<Vector3>& polygon, const std::string& what) {
  const std::vector<TriangleIndices> triangles = triangles_of(polygon);
  ASSERT_EQ(triangles.size(), polygon.size() - 2) << what;
  Vector3 area = Vector3::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k) area += area_of(polygon, 0, k - 1, k);
  Scalar sum = 0;
  std::map<std::pair<int, int>, int> edges;
  for (const TriangleIndices& t : triangles) {
    const Vector3 part = area_of(polygon, std::size_t(t[0]), std::size_t(t[1]), std::size_t(t[2]));
    EXPECT_GT(part.dot(area), 0) << what;
    sum += part.norm();
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  EXPECT_NEAR(sum, area.norm(), 1e-6 * area.norm()) << what;
  const int n = int(polygon.size());
  for (const auto& [edge, uses] : edges) {
    const bool is_rim = edge.second == (edge.first + 1) % n;
    EXPECT_EQ(uses, 1) << what;
    EXPECT_EQ(edges.contains({edge.second, edge.first}), !is_rim) << what;
  }
}

TEST(Triangulation, MakesTheFanOfAConvexPolygon) {
  const std::vector<Vector3> pentagon{Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(3, 1, 0),
                                      Vector3(1, 3, 0), Vector3(-1, 1, 0)};
  const std::vector<TriangleIndices> fan{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};
  EXPECT_EQ(triangles_of(pentagon), fan);
}

TEST(Triangulation, RepeatsTheLastCornerOfSegmentsAndPoints) {
  const std::vector<Vector3> p{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
  EXPECT_EQ(triangles_of({p[0]}), (std::vector<TriangleIndices>{{0, 0, 0}}));
  EXPECT_EQ(triangles_of({p[0], p[1]}), (std::vector<TriangleIndices>{{0, 1, 1}}));
  EXPECT_EQ(triangles_of(p), (std::vector<TriangleIndices>{{0, 1, 2}}));
}

TEST(Triangulation, CutsAnArrowheadWhereAFanWouldLeaveIt) {
  // From corner 0 the fan would cover the notch at corner 2.
  expect_triangulation({Vector3(0, 0, 0), Vector3(4, 4, 0), Vector3(0, 1, 0), Vector3(-4, 4, 0)},
                       "arrowhead, notch in front");
  expect_triangulation({Vector3(4, 4, 0), Vector3(0, 1, 0), Vector3(-4, 4, 0), Vector3(0, 0, 0)},
                       "arrowhead, notch second");
}

TEST(Triangulation, CutsAPolygonWithCornersAlongItsEdges) {
  expect_triangulation({Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(2, 0, 0), Vector3(2, 1, 0),
                        Vector3(2, 2, 0), Vector3(1, 2, 0), Vector3(1, 1, 0), Vector3(0, 1, 0)},
                       "L with corners along its edges");
}

// Stars about a centre: simple whatever their radii.
std::vector<Vector3> random_star(Scalar size, const Vector3& middle, std::mt19937_64& random) {
  const int count = 4 + testing::random_index(60, random);
  const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
  std::vector<Vector3> polygon;
  for (int k = 0; k < count; ++k) {
    const Scalar angle =
        2 * std::numbers::pi * (k + testing::random_number(0, 0.9, random)) / count;
    const Scalar radius = size * testing::random_number(0.1, 1, random);
    polygon.push_back(middle + R * (radius * Vector3(std::cos(angle), std::sin(angle), 0)));
  }
  return polygon;
}

TEST(Triangulation, CutsRandomStarsAtEveryScaleAndPlace) {
  std::mt19937_64 random(20260703);
  int concave = 0;
  for (int round = 0; round < 1000; ++round) {
    const Scalar size = testing::random_magnitude(-4, 4, random);
    const Vector3 middle = size * testing::random_number(0, 1000, random) * Vector3(1, -2, 3);
    const std::vector<Vector3> star = random_star(size, middle, random);
    expect_triangulation(star, "round " + std::to_string(round));
    const TriangleIndices first = triangles_of(star).front();
    concave += first != TriangleIndices{0, 1, 2};
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(concave, 300);  // the first ear is not at corner 1
}

TEST(Triangulation, KeepsTheRimOfWhatHasNoPlane) {
  // A saddle, a polygon that crosses itself, one without area, one with a repeated corner.
  for (const std::vector<Vector3>& polygon : std::vector<std::vector<Vector3>>{
           {Vector3(0, 0, 0), Vector3(1, 0, 1), Vector3(1, 1, 0), Vector3(0, 1, 1)},
           {Vector3(0, 0, 0), Vector3(1, 1, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)},
           {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(2, 0, 0), Vector3(3, 0, 0)},
           {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)}}) {
    const std::vector<TriangleIndices> triangles = triangles_of(polygon);
    ASSERT_EQ(triangles.size(), 2u);
    std::map<std::pair<int, int>, int> edges;
    for (const TriangleIndices& t : triangles) {
      for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    }
    for (int k = 0; k < 4; ++k) EXPECT_EQ((edges[{k, (k + 1) % 4}]), 1);
  }
}

TEST(Triangulation, RefusesConcavePolygonsBeyondTheLimit) {
  std::vector<Vector3> comb;
  for (std::size_t k = 0; k < kMostConcaveCorners; ++k) {
    comb.emplace_back(Scalar(k), k % 2 == 0 ? 0.0 : 1.0, 0);
  }
  comb.emplace_back(Scalar(kMostConcaveCorners) / 2, 1e5, 0);
  try {
    triangles_of(comb);
    ADD_FAILURE() << "no error";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("4097 corners"), std::string::npos) << error.what();
  }
  comb.pop_back();
  EXPECT_EQ(triangles_of(comb).size(), kMostConcaveCorners - 2);
}

}  // namespace
}  // namespace dyop::io_internal
