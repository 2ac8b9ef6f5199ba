// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cap_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace dyop::tissue_internal {
namespace {

using Eigen::Vector2d;

// A loop of `count` points, counterclockwise unless `count` is negative.
void add_ring(PlaneRegion& region, const Vector2d& middle, Scalar radius, int count) {
  std::vector<std::int32_t>& loop = region.loops.emplace_back();
  for (int k = 0; k < std::abs(count); ++k) {
    const Scalar angle = 2 * std::numbers::pi * k / count;
    loop.push_back(std::int32_t(region.points.size()));
    region.points.emplace_back(middle + radius * Vector2d(std::cos(angle), std::sin(angle)));
  }
}

Scalar area_of(const PlaneRegion& region, const TriangleIndices& t) {
  const Vector2d a = region.points[std::size_t(t[1])] - region.points[std::size_t(t[0])];
  const Vector2d b = region.points[std::size_t(t[2])] - region.points[std::size_t(t[0])];
  return (a.x() * b.y() - a.y() * b.x()) / 2;
}

Scalar polygon_area(Scalar radius, int count) {
  return count * radius * radius * std::sin(2 * std::numbers::pi / count) / 2;
}

TEST(CapMesh, FillsARegionWithHoles) {
  for (const Scalar spacing : {0.0, 0.2}) {
    PlaneRegion region;
    add_ring(region, {0, 0}, 3, 60);
    add_ring(region, {1, 0.3}, 0.5, -20);
    add_ring(region, {-1, 0.2}, 0.7, -24);
    add_ring(region, {-1, 0.2}, 0.3, 12);  // an island
    add_ring(region, {0.1, -1.4}, 0.2, -8);
    const auto triangles = triangulate(region, spacing);
    ASSERT_TRUE(triangles);
    Scalar area = 0;
    std::map<std::pair<int, int>, int> edges;
    for (const TriangleIndices& t : *triangles) {
      EXPECT_GT(area_of(region, t), 0);
      area += area_of(region, t);
      for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
    EXPECT_NEAR(area,
                polygon_area(3, 60) - polygon_area(0.5, 20) - polygon_area(0.7, 24) +
                    polygon_area(0.3, 12) - polygon_area(0.2, 8),
                1e-12);
    // Only the loops' edges have one side.
    int open = 0;
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      open += !edges.contains({edge.second, edge.first});
    }
    EXPECT_EQ(open, 60 + 20 + 24 + 12 + 8);
    EXPECT_EQ(region.points.size() > 124, spacing > 0);
  }
}

TEST(CapMesh, KeepsPointsOnAStraightSide) {
  PlaneRegion region;
  region.points = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {0, 2}, {0, 1}};
  region.loops = {{0, 1, 2, 3, 4, 5, 6, 7}};
  const auto triangles = triangulate(region, 0);
  ASSERT_TRUE(triangles);
  EXPECT_EQ(triangles->size(), 6u);
  for (const TriangleIndices& t : *triangles) EXPECT_GT(area_of(region, t), 0.1);
}

// A strip that is bent by more than a full turn, so that its ends lie over each other.
TEST(CapMesh, FillsAStripThatLiesOverItself) {
  PlaneRegion region;
  constexpr int kSteps = 50;
  constexpr Scalar kStep = 2.5 * std::numbers::pi / kSteps;
  std::vector<std::int32_t>& loop = region.loops.emplace_back();
  const auto add = [&](Scalar radius, int k) {
    loop.push_back(std::int32_t(region.points.size()));
    region.points.emplace_back(radius * Vector2d(std::cos(k * kStep), std::sin(k * kStep)));
  };
  for (int k = 0; k <= kSteps; ++k) add(1.5, k);
  for (int k = kSteps; k >= 0; --k) add(1, k);
  const auto triangles = triangulate(region, 0);
  ASSERT_TRUE(triangles);
  Scalar area = 0;
  for (const TriangleIndices& t : *triangles) {
    EXPECT_GT(area_of(region, t), 0);
    area += area_of(region, t);
  }
  EXPECT_NEAR(area, kSteps * (1.5 * 1.5 - 1) * std::sin(kStep) / 2, 1e-12);
}

TEST(CapMesh, RefusesLoopsThatCross) {
  PlaneRegion eight;
  eight.points = {{0, 0}, {2, 2}, {2, 0}, {0, 1}};
  eight.loops = {{0, 1, 2, 3}};
  EXPECT_FALSE(triangulate(eight, 0));
  PlaneRegion outside;
  add_ring(outside, {0, 0}, 1, 12);
  add_ring(outside, {5, 0}, 1, -12);
  EXPECT_FALSE(triangulate(outside, 0));
}

Scalar area_of(const PlaneRegion& region, const std::vector<TriangleIndices>& triangles) {
  Scalar twice = 0;
  for (const TriangleIndices& t : triangles) {
    const Eigen::Vector2d a = region.points[std::size_t(t[0])];
    const Eigen::Vector2d b = region.points[std::size_t(t[1])] - a;
    const Eigen::Vector2d c = region.points[std::size_t(t[2])] - a;
    twice += b.x() * c.y() - b.y() * c.x();
  }
  return twice / 2;
}

// A hole outside, and one that crosses the loop around it.
TEST(CapMesh, FillsACrumpledRegion) {
  for (const Scalar x : {5.0, 0.9}) {
    PlaneRegion region;
    region.is_crumpled = true;
    add_ring(region, {0, 0}, 1, 12);
    add_ring(region, {x, 0}, 0.3, -12);
    const auto triangles = triangulate(region, 0);
    ASSERT_TRUE(triangles) << x;
    EXPECT_NEAR(area_of(region, *triangles), 3 * (1 - 0.09), 1e-12) << x;
  }
}

}  // namespace
}  // namespace dyop::tissue_internal
