// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_mesh.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "dyop/core/error.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::MeshArrays;

std::vector<Vector3> shaken(const std::vector<Vector3>& places, Scalar by,
                            std::mt19937_64& random) {
  std::vector<Vector3> moved = places;
  for (Vector3& p : moved) p += testing::random_vector(by, random);
  return moved;
}

// Every triangle is at exactly one leaf, and the boxes of all nodes above it hold it at all times.
void check_tree(const DeformingMesh& mesh) {
  const auto nodes = mesh.nodes();
  ASSERT_EQ(nodes.size(), 2 * mesh.triangles().size() - 1);
  std::vector<int> seen(mesh.triangles().size(), 0);
  std::vector<std::int32_t> parent(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].is_leaf) continue;
    for (const std::int32_t child : {nodes[i].first, nodes[i].first + 1}) {
      ASSERT_GT(child, static_cast<std::int32_t>(i));
      parent[static_cast<std::size_t>(child)] = static_cast<std::int32_t>(i);
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!nodes[i].is_leaf) continue;
    ++seen[static_cast<std::size_t>(nodes[i].first)];
    int depth = 0;
    for (auto node = static_cast<std::int32_t>(i); node >= 0;
         node = parent[static_cast<std::size_t>(node)]) {
      const DeformingMesh::Node& box = nodes[static_cast<std::size_t>(node)];
      for (const std::int32_t vertex : mesh.triangles()[static_cast<std::size_t>(nodes[i].first)]) {
        EXPECT_TRUE(box.at_begin.contains(mesh.begin()[static_cast<std::size_t>(vertex)]));
        EXPECT_TRUE(box.at_end.contains(mesh.end()[static_cast<std::size_t>(vertex)]));
      }
      ++depth;
    }
    EXPECT_LE(depth, 33);
  }
  for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(DeformingMesh, HoldsEveryTriangleInItsSweptBoxes) {
  std::mt19937_64 random(1);
  for (const MeshArrays& arrays : {testing::icosphere(2), testing::random_soup(77, 0.3, 5),
                                   testing::needle(2, 9), testing::point_cloud(33, 4)}) {
    const DeformingMesh mesh(arrays.vertices, shaken(arrays.vertices, 0.5, random),
                             arrays.triangles);
    check_tree(mesh);
  }
}

TEST(DeformingMesh, RefitsToNewPlaces) {
  std::mt19937_64 random(2);
  const MeshArrays arrays = testing::icosphere(1);
  DeformingMesh mesh(arrays.vertices, arrays.vertices, arrays.triangles);
  EXPECT_EQ(mesh.largest_displacement(), 0);
  const std::vector<Vector3> second = shaken(arrays.vertices, 2, random);
  mesh.advance(second);
  check_tree(mesh);
  const std::vector<Vector3> third = shaken(second, 2, random);
  mesh.advance(third);
  check_tree(mesh);
  EXPECT_EQ(mesh.begin()[5], second[5]);
  EXPECT_EQ(mesh.end()[5], third[5]);
  EXPECT_GT(mesh.largest_displacement(), 1);
}

TEST(DeformingMesh, MovesItsTrianglesOnStraightLines) {
  const DeformingMesh mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 4}, {1, 0, 0}, {0, 3, 0}},
                           {{0, 1, 2}});
  const Triangle quarter = mesh.triangle(0, 0.25);
  EXPECT_EQ(quarter[0], Vector3(0, 0, 1));
  EXPECT_EQ(quarter[1], Vector3(1, 0, 0));
  EXPECT_EQ(quarter[2], Vector3(0, 1.5, 0));
  EXPECT_EQ(mesh.triangle(0, 1)[0], Vector3(0, 0, 4));
  EXPECT_GE(mesh.largest_radius(), 4);
  EXPECT_GE(mesh.largest_displacement(), 4);
}

TEST(DeformingMesh, RefusesInvalidInput) {
  const std::vector<Vector3> places{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vector3> fewer{{0, 0, 0}, {1, 0, 0}};
  std::vector<Vector3> broken = places;
  broken[1].z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(DeformingMesh(places, places, {}), InvalidArgument);
  EXPECT_THROW(DeformingMesh(places, fewer, {{0, 1, 2}}), InvalidArgument);
  EXPECT_THROW(DeformingMesh(places, places, {{0, 1, 3}}), InvalidArgument);
  EXPECT_THROW(DeformingMesh(places, places, {{0, -1, 2}}), InvalidArgument);
  EXPECT_THROW(DeformingMesh(places, broken, {{0, 1, 2}}), InvalidArgument);
  DeformingMesh mesh(places, places, {{0, 1, 2}});
  EXPECT_THROW(mesh.advance(broken), InvalidArgument);
  EXPECT_THROW(mesh.refit(fewer, fewer), InvalidArgument);
  EXPECT_EQ(mesh.end()[1], places[1]) << "unchanged after a refusal";
}

}  // namespace
}  // namespace dyop
