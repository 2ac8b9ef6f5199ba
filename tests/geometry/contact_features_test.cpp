// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/contact_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <thread>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::MeshArrays;

int count_edges(const TriangleMesh& mesh, EdgeKind kind) {
  int count = 0;
  for (std::int32_t e = 0; e < mesh.topology().edge_count(); ++e) {
    count += mesh.contact_features().edge_kind(e) == kind;
  }
  return count;
}

int count_contact_edges(const TriangleMesh& mesh) {
  int count = 0;
  for (std::int32_t e = 0; e < mesh.topology().edge_count(); ++e) {
    count += mesh.contact_features().is_contact_edge(e);
  }
  return count;
}

int count_contact_vertices(const TriangleMesh& mesh) {
  int count = 0;
  for (std::int32_t v = 0; v < mesh.topology().vertex_count(); ++v) {
    count += mesh.contact_features().is_contact_vertex(v);
  }
  return count;
}

TEST(ContactFeatures, OfABoxAreItsEdgesAndCorners) {
  const Box box(Vector3(1, 2, 3));
  const TriangleMesh& mesh = *box.core_surface();
  EXPECT_EQ(count_edges(mesh, EdgeKind::Convex), 12);
  EXPECT_EQ(count_edges(mesh, EdgeKind::Flat), 6);
  EXPECT_EQ(count_contact_edges(mesh), 12);
  EXPECT_EQ(count_contact_vertices(mesh), 8);
}

TEST(ContactFeatures, OfAFlatSheetAreOnItsBorder) {
  const TriangleMesh sheet = testing::plate_grid(2, 3, 5, 7).mesh();
  EXPECT_EQ(count_edges(sheet, EdgeKind::Border), 2 * (5 + 7));
  EXPECT_EQ(count_edges(sheet, EdgeKind::Flat), sheet.topology().edge_count() - 24);
  EXPECT_EQ(count_contact_edges(sheet), 24);
  EXPECT_EQ(count_contact_vertices(sheet), 24);
}

// Seen from within, the hollow of a torus has edges that bend outwards.
TEST(ContactFeatures, ATorusHasConvexAndConcaveEdgesAndSaddles) {
  const TriangleMesh torus = testing::torus(2, 0.7, 12, 8).mesh();
  EXPECT_GT(count_edges(torus, EdgeKind::Convex), 0);
  EXPECT_GT(count_edges(torus, EdgeKind::Concave), 0);
  EXPECT_GT(count_contact_vertices(torus), 0);
  EXPECT_LT(count_contact_vertices(torus), torus.topology().vertex_count());
}

// The winding of a closed mesh decides what is convex; its rotation in space does not matter.
TEST(ContactFeatures, WindingTurnsConvexIntoConcave) {
  MeshArrays sphere = testing::icosphere(1);
  EXPECT_EQ(count_edges(sphere.mesh(), EdgeKind::Convex), sphere.mesh().topology().edge_count());
  for (TriangleIndices& t : sphere.triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(count_edges(sphere.mesh(), EdgeKind::Concave), sphere.mesh().topology().edge_count());
  EXPECT_EQ(count_contact_vertices(sphere.mesh()), sphere.mesh().topology().vertex_count());
}

TEST(ContactFeatures, KeepsWhatIsInDoubt) {
  MeshArrays arrays;
  // Two triangles of a plane with one of zero area between them.
  arrays.vertices = {Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(1, 0, 0), Vector3(1, 1, 0),
                     Vector3(1, -1, 0)};
  arrays.triangles = {{0, 1, 3}, {0, 2, 1}, {0, 4, 2}, {2, 4, 1}};
  const TriangleMesh mesh = arrays.mesh();
  for (std::int32_t e = 0; e < mesh.topology().edge_count(); ++e) {
    const auto& ends = mesh.topology().edge(e);
    const bool is_on_seam = mesh.vertices()[std::size_t(ends[0])].y() == 0 &&
                            mesh.vertices()[std::size_t(ends[1])].y() == 0;
    if (!is_on_seam) continue;
    EXPECT_TRUE(mesh.contact_features().is_contact_edge(e));
    EXPECT_TRUE(mesh.contact_features().is_doubtful_edge(e));
  }
  for (std::int32_t v = 0; v < 3; ++v) {
    EXPECT_TRUE(mesh.contact_features().is_doubtful_vertex(v));
    EXPECT_TRUE(mesh.contact_features().is_contact_vertex(v));
  }
}

TEST(ContactFeatures, AFinOnAPlateIsTouchedAtItsRimOnly) {
  MeshArrays arrays;
  arrays.vertices = {Vector3(0, -1, 0), Vector3(0, 1, 0), Vector3(1, 0, 0), Vector3(-1, 0, 0),
                     Vector3(0, 0, 1)};
  arrays.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const TriangleMesh mesh = arrays.mesh();
  EXPECT_EQ(mesh.contact_features().edge_kind(0), EdgeKind::NonManifold);
  EXPECT_FALSE(mesh.contact_features().is_contact_edge(0));
  // With the plate bent up the fin's foot can be touched from below.
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  vertices[2].z() = vertices[3].z() = 0.1;
  EXPECT_TRUE(mesh.with_vertices(vertices).contact_features().is_contact_edge(0));
}

TEST(ContactFeatures, EveryOneIsOwnedOnceAndFoundInTheTree) {
  std::mt19937_64 random(2);
  for (const MeshArrays& arrays : {testing::gear(5, 1, 1.4, 0.5), testing::torus(1, 0.4, 9, 7),
                                   testing::random_soup(40, 0.3, 4), testing::needle(2, 5)}) {
    const TriangleMesh mesh = arrays.mesh();
    const ContactFeatures& features = mesh.contact_features();
    int vertices = 0;
    int edges = 0;
    for (std::int32_t t = 0; t < std::int32_t(mesh.triangles().size()); ++t) {
      for (int k = 0; k < 3; ++k) {
        if (features.owned_by(t) >> k & 1) {
          ++vertices;
          EXPECT_TRUE(features.is_contact_vertex(mesh.triangles()[std::size_t(t)][std::size_t(k)]));
        }
        if (features.owned_by(t) >> (3 + k) & 1) {
          ++edges;
          EXPECT_TRUE(features.is_contact_edge(*mesh.topology().edge_of_side(3 * t + k)));
        }
      }
    }
    EXPECT_EQ(vertices, count_contact_vertices(mesh));
    EXPECT_EQ(edges, count_contact_edges(mesh));
    const auto& nodes = mesh.hierarchy().nodes();
    for (std::size_t node = 0; node < nodes.size(); ++node) {
      for (int column = 0; column < nodes[node].count(); ++column) {
        const std::int32_t child = nodes[node].child[column];
        const bool has_vertices = features.columns_with_vertices(std::int32_t(node)) >> column & 1;
        const bool has_edges = features.columns_with_edges(std::int32_t(node)) >> column & 1;
        EXPECT_EQ(has_vertices, child < 0 ? (features.owned_by(-1 - child) & 7) != 0
                                          : features.columns_with_vertices(child) != 0);
        EXPECT_EQ(has_edges, child < 0 ? (features.owned_by(-1 - child) & 56) != 0
                                       : features.columns_with_edges(child) != 0);
      }
    }
  }
}

// A vertex that is dropped has no n with n . t < 0 along all its edges: samples find none either.
TEST(ContactFeatures, DropsNoVertexWithANormalCone) {
  std::mt19937_64 random(6);
  int dropped = 0;
  for (int k = 0; k < 20; ++k) {
    MeshArrays arrays = testing::icosphere(1);
    for (Vector3& p : arrays.vertices) p *= testing::random_number(0.6, 1.4, random);
    const TriangleMesh mesh = arrays.mesh();
    for (std::int32_t v = 0; v < mesh.topology().vertex_count(); ++v) {
      if (mesh.contact_features().is_contact_vertex(v)) continue;
      ++dropped;
      for (int sample = 0; sample < 2000; ++sample) {
        const Vector3 n = testing::random_direction(random);
        bool is_normal = true;
        for (const std::int32_t corner : mesh.topology().corners_of_vertex(v)) {
          for (const std::int32_t other : mesh.triangles()[std::size_t(corner / 3)]) {
            const Vector3 ray =
                mesh.vertices()[std::size_t(other)] - mesh.vertices()[std::size_t(v)];
            is_normal = is_normal && n.dot(ray) <= 0;
          }
        }
        ASSERT_FALSE(is_normal);
      }
    }
  }
  EXPECT_GT(dropped, 20);
}

TEST(ContactFeatures, AreTheSameForThreadsThatAskAtOnce) {
  const TriangleMesh mesh = testing::icosphere(3).mesh();
  std::array<const ContactFeatures*, 4> found{};
  std::vector<std::thread> threads;
  for (auto& place : found) threads.emplace_back([&] { place = &mesh.contact_features(); });
  for (std::thread& thread : threads) thread.join();
  for (const ContactFeatures* features : found) EXPECT_EQ(features, found[0]);
}

}  // namespace
}  // namespace dyop
