// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/haptic_scene_file.h"

namespace dyop {
namespace {

void check_solid(const AnatomyMesh& made) {
  const TriangleMesh mesh(made.vertices, made.triangles);
  EXPECT_TRUE(mesh.is_closed());
  EXPECT_EQ(mesh.part_vertices().size(), 1u);
  EXPECT_GT(mesh.compute_mass_properties(1).mass, 0);  // wound outwards
}

void check_rings(const AnatomyMesh& made, std::size_t wanted) {
  EXPECT_NEAR(double(made.triangles.size()), double(wanted), 0.1 * double(wanted));
  check_solid(made);
}

// The triangle on the left of every directed side: on a manifold there is one of each.
std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> sides_of(const AnatomyMesh& made) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> sides;
  for (std::size_t t = 0; t < made.triangles.size(); ++t) {
    const TriangleIndices& c = made.triangles[t];
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_TRUE(sides.insert({{c[k], c[(k + 1) % 3]}, t}).second);
  }
  return sides;
}

TEST(Anatomy, TheLiverIsAManifoldWithoutNeedles) {
  for (const auto& [wanted, expected] : std::map<std::size_t, std::size_t>{
           {32, 20}, {400, 320}, {1000, 980}, {4000, 3920}, {30000, 30420}}) {
    const AnatomyMesh liver = make_liver(wanted);
    ASSERT_EQ(liver.triangles.size(), expected);
    ASSERT_EQ(liver.vertices.size(), expected / 2 + 2);  // Euler's formula: it has no handle
    check_solid(liver);
    const auto sides = sides_of(liver);
    Scalar shortest = 1e3, longest = 0;
    std::vector<int> sides_at(liver.vertices.size());
    for (const auto& [ends, triangle] : sides) {
      EXPECT_TRUE(sides.contains({ends.second, ends.first}));
      ++sides_at[std::size_t(ends.first)];
      const Vector3 side =
          liver.vertices[std::size_t(ends.second)] - liver.vertices[std::size_t(ends.first)];
      shortest = std::min(shortest, side.norm());
      longest = std::max(longest, side.norm());
    }
    EXPECT_LT(longest, 2.5 * shortest);
    EXPECT_EQ(std::count(sides_at.begin(), sides_at.end(), 5), 12);
    EXPECT_EQ(std::count(sides_at.begin(), sides_at.end(), 6), std::ptrdiff_t(expected / 2 - 10));
    // Every triangle faces away from the middle, which sees all of the surface.
    for (const auto& [a, b, c] : liver.triangles) {
      const Vector3& p = liver.vertices[std::size_t(a)];
      EXPECT_GT(p.dot(liver.vertices[std::size_t(b)].cross(liver.vertices[std::size_t(c)])), 0);
    }
  }
}

// The surface is the same whatever its triangles: vertices of one are near those of another.
TEST(Anatomy, TheLiverHasOneShapeForAllNumbersOfTriangles) {
  const AnatomyMesh coarse = make_liver(1000);
  const AnatomyMesh made = make_liver(30000);
  const TriangleMesh fine(made.vertices, made.triangles);
  EXPECT_NEAR(TriangleMesh(coarse.vertices, coarse.triangles).compute_mass_properties(1).mass,
              fine.compute_mass_properties(1).mass, 0.02 * fine.compute_mass_properties(1).mass);
  for (const Vector3& p : coarse.vertices) {
    Scalar nearest = 1e3;
    for (const Vector3& q : made.vertices) nearest = std::min(nearest, (p - q).norm());
    EXPECT_LT(nearest, 2);
  }
}

TEST(Anatomy, VesselsAndInstrumentsAreClosedAndOfTheSizeAskedFor) {
  for (const std::size_t triangles : {400U, 3000U, 30000U}) {
    check_rings(make_vessel(triangles), triangles);
    check_rings(make_shaft(triangles, 2.5, 250), triangles);
    check_rings(make_jaw(triangles, 2.4, 18), triangles);
  }
}

TEST(Anatomy, TheWallIsAnOpenSheet) {
  const AnatomyMesh wall = make_wall(30000);
  const TriangleMesh mesh(wall.vertices, wall.triangles);
  EXPECT_NEAR(double(mesh.triangles().size()), 30000, 600);
  EXPECT_FALSE(mesh.is_closed());
}

TEST(Anatomy, RefusesTooFewTriangles) {
  EXPECT_THROW(make_liver(8), InvalidArgument);
  EXPECT_THROW(make_wall(0), InvalidArgument);
}

}  // namespace
}  // namespace dyop
