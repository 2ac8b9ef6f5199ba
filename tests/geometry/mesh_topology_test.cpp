// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/mesh_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <thread>

#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::MeshArrays;
using Edge = std::array<std::int32_t, 2>;

// Any triangles over a few vertices: repeated numbers, duplicates, edges of many triangles.
std::vector<TriangleIndices> random_triangles(int count, int vertices, std::mt19937_64& random) {
  std::vector<TriangleIndices> triangles;
  for (int k = 0; k < count; ++k) {
    TriangleIndices t;
    for (std::int32_t& v : t) v = testing::random_index(vertices, random);
    triangles.push_back(t);
  }
  return triangles;
}

// Every edge with its sides, by the definition.
std::map<Edge, std::vector<std::int32_t>> sides_of_edges(
    const std::vector<TriangleIndices>& triangles) {
  std::map<Edge, std::vector<std::int32_t>> sides;
  for (std::size_t side = 0; side < 3 * triangles.size(); ++side) {
    const TriangleIndices& t = triangles[side / 3];
    const std::int32_t from = t[side % 3];
    const std::int32_t to = t[(side % 3 + 1) % 3];
    if (from != to) sides[{std::min(from, to), std::max(from, to)}].push_back(std::int32_t(side));
  }
  return sides;
}

void expect_topology(const MeshTopology& topology, const std::vector<TriangleIndices>& triangles) {
  const auto sides = sides_of_edges(triangles);
  ASSERT_EQ(std::size_t(topology.edge_count()), sides.size());
  std::int32_t edge = 0;
  for (const auto& [ends, expected] : sides) {
    EXPECT_EQ(topology.edge(edge), ends);
    EXPECT_TRUE(std::ranges::equal(topology.sides_of_edge(edge), expected));
    for (const std::int32_t side : expected) EXPECT_EQ(topology.edge_of_side(side), edge);
    ++edge;
  }
  std::size_t corners = 0;
  for (std::int32_t v = 0; v < topology.vertex_count(); ++v) {
    const auto at = topology.corners_of_vertex(v);
    EXPECT_TRUE(std::ranges::is_sorted(at));
    for (const std::int32_t corner : at) {
      EXPECT_EQ(triangles[std::size_t(corner / 3)][std::size_t(corner % 3)], v);
    }
    corners += at.size();
  }
  EXPECT_EQ(corners, 3 * triangles.size());
}

TEST(MeshTopology, JoinsAnyTriangles) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 300; ++k) {
    const int vertices = 1 + testing::random_index(12, random);
    const auto triangles =
        random_triangles(1 + testing::random_index(40, random), vertices, random);
    expect_topology(MeshTopology(std::size_t(vertices), triangles), triangles);
  }
}

TEST(MeshTopology, GivesSidesOfOneVertexNoEdge) {
  const std::vector<TriangleIndices> triangles{{0, 0, 1}, {2, 2, 2}};
  const MeshTopology topology(3, triangles);
  EXPECT_EQ(topology.edge_count(), 1);
  EXPECT_EQ(topology.edge_of_side(0), std::nullopt);
  EXPECT_EQ(topology.edge_of_side(3), std::nullopt);
  EXPECT_EQ(topology.edge_of_side(1), topology.edge_of_side(2));
  EXPECT_FALSE(topology.is_closed());
}

TEST(MeshTopology, TakesAFanOfManyTrianglesAtOneVertex) {
  std::vector<TriangleIndices> triangles;
  constexpr std::int32_t kCount = 20000;
  for (std::int32_t k = 1; k <= kCount; ++k) triangles.push_back({0, k, k % kCount + 1});
  const MeshTopology topology(kCount + 1, triangles);
  EXPECT_EQ(topology.edge_count(), 2 * kCount);
  EXPECT_EQ(topology.corners_of_vertex(0).size(), std::size_t(kCount));
}

TEST(MeshTopology, IsSharedByAMeshAndItsCopiesWithOtherVertices) {
  const TriangleMesh mesh = testing::icosphere(1).mesh();
  const TriangleMesh copy = mesh;
  EXPECT_EQ(&copy.topology(), &mesh.topology());
  EXPECT_EQ(&copy.contact_features(), &mesh.contact_features());
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& p : vertices) p.z() = 0;
  const TriangleMesh flat = mesh.with_vertices(vertices);
  EXPECT_EQ(&flat.topology(), &mesh.topology());
  // What depends on the shape does not.
  EXPECT_NE(&flat.contact_features(), &mesh.contact_features());
}

// It is found on first use, and meshes that differ only in where their vertices are share it.
TEST(MeshTopology, IsFoundOnceByThreadsThatAskAtOnce) {
  const TriangleMesh mesh = testing::icosphere(3).mesh();
  const TriangleMesh moved =
      mesh.with_vertices(std::vector<Vector3>(mesh.vertices().begin(), mesh.vertices().end()));
  std::array<const MeshTopology*, 4> found{};
  std::array<std::span<const std::int32_t>, 4> parts;
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < found.size(); ++k) {
    threads.emplace_back([&, k] {
      const TriangleMesh& asked = k % 2 == 0 ? mesh : moved;
      EXPECT_TRUE(asked.is_closed());
      found[k] = &asked.topology();
      parts[k] = asked.part_vertices();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k], found[0]);
    EXPECT_EQ(parts[k].data(), parts[0].data());
    EXPECT_EQ(parts[k].size(), 1);
  }
}

}  // namespace
}  // namespace dyop
