// SPDX-License-Identifier: BSD-3-Clause

// Contacts on inner edges would stop a body that slides over them: there must be none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "dyop/contact/contact_generator.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::MeshArrays;
using testing::random_number;

constexpr Scalar kHalfWidth = 4;

// 8,192 triangles; diagonals one way.
MeshArrays plain_grid() {
  return testing::plate_grid(2 * kHalfWidth, 2 * kHalfWidth, 64, 64);
}

// Every other diagonal the other way, half of the triangles wound the other way.
MeshArrays mixed_grid() {
  MeshArrays grid = plain_grid();
  for (std::size_t k = 0; k + 1 < grid.triangles.size(); k += 4) {
    std::swap(grid.triangles[k][0], grid.triangles[k][1]);
  }
  return grid;
}

// Inner vertices moved within the plane.
MeshArrays irregular_grid() {
  MeshArrays grid = plain_grid();
  std::mt19937_64 random(3);
  for (Vector3& p : grid.vertices) {
    if (p.cwiseAbs().maxCoeff() > kHalfWidth - 0.01) continue;
    p.x() += random_number(-0.03, 0.03, random);
    p.y() += random_number(-0.03, 0.03, random);
  }
  return grid;
}

// Triangles without common vertices, some twice.
MeshArrays shattered_grid() {
  const MeshArrays whole = plain_grid();
  MeshArrays grid;
  for (std::size_t k = 0; k < whole.triangles.size(); ++k) {
    const auto first = std::int32_t(grid.vertices.size());
    for (const std::int32_t v : whole.triangles[k]) {
      grid.vertices.push_back(whole.vertices[std::size_t(v)]);
    }
    grid.triangles.push_back({first, first + 1, first + 2});
    if (k % 7 == 0) grid.triangles.push_back({first, first + 2, first + 1});
  }
  return grid;
}

// Rows whose cells do not meet at vertices: long triangles against short ones.
MeshArrays rows_with_t_junctions() {
  MeshArrays grid;
  for (int row = -8; row < 8; ++row) {
    const int cells = row % 2 == 0 ? 3 : 40;
    for (int k = 0; k < cells; ++k) {
      const auto first = std::int32_t(grid.vertices.size());
      const Scalar x0 = -kHalfWidth + 2 * kHalfWidth * k / cells;
      const Scalar x1 = -kHalfWidth + 2 * kHalfWidth * (k + 1) / cells;
      const Scalar y0 = kHalfWidth * row / 8;
      const Scalar y1 = kHalfWidth * (row + 1) / 8;
      for (const Vector2& p :
           {Vector2(x0, y0), Vector2(x1, y0), Vector2(x1, y1), Vector2(x0, y1)}) {
        grid.vertices.emplace_back(p.x(), p.y(), 0);
      }
      grid.triangles.push_back({first, first + 1, first + 2});
      grid.triangles.push_back({first, first + 2, first + 3});
    }
  }
  return grid;
}

// Closed boxes beside each other, their tops flush.
MeshArrays tiles() {
  MeshArrays floor;
  for (int i = -8; i < 8; ++i) {
    for (int j = -8; j < 8; ++j) {
      MeshArrays tile = testing::box_mesh(Vector3(0.25, 0.25, 0.25));
      const auto first = std::int32_t(floor.vertices.size());
      for (const Vector3& p : tile.vertices) {
        floor.vertices.push_back(p + Vector3(0.5 * i + 0.25, 0.5 * j + 0.25, -0.25));
      }
      for (const TriangleIndices& t : tile.triangles) {
        floor.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      }
    }
  }
  return floor;
}

enum class Joined { ByVertexNumbers, ByPlaceOnly };

// Slides a cube over a plane of triangles, in steps that land it everywhere, vertices and edges
// included. Where vertex numbers do not join the triangles, their flat corners count as contacts,
// too.
void expect_only_the_planes_normal(const MeshArrays& floor, int steps, Joined joined) {
  const TriangleMesh mesh = floor.mesh();
  const Box cube(Vector3(0.5, 0.5, 0.5));
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  for (const Scalar degrees : {0.0, 7.0, 15.0, 45.0}) {
    const Quaternion turn(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3::UnitZ()));
    for (int step = 0; step < steps; ++step) {
      const Scalar x = -3 + 6.0 * step / steps;
      const Scalar y = step % 3 == 0 ? 0 : std::sin(0.7 * step);
      for (const Scalar gap : {1e-2, 1e-5}) {
        generate_contacts(mesh, RigidPose(), cube, RigidPose(turn, Vector3(x, y, 0.5 + gap)),
                          5 * gap, {}, workspace, contacts);
        SCOPED_TRACE(::testing::Message() << degrees << " degrees, at " << x << ' ' << y);
        ASSERT_GE(contacts.size(), 4u);
        if (joined == Joined::ByVertexNumbers) {
          ASSERT_EQ(contacts.size(), 4u);
        }
        const auto is_corner = [](const ContactPoint& contact) {
          return contact.p_BCb.cwiseAbs().isApprox(Vector3(0.5, 0.5, 0.5), 1e-9);
        };
        ASSERT_EQ(std::count_if(contacts.begin(), contacts.end(), is_corner), 4);
        for (const ContactPoint& contact : contacts) {
          ASSERT_GT(contact.nhat_AB_W.z(), 1 - 1e-12);
          ASSERT_NEAR(contact.gap, gap, 1e-12);
        }
      }
    }
  }
}

TEST(GhostContacts, NoneOnAGrid) {
  expect_only_the_planes_normal(plain_grid(), 100, Joined::ByVertexNumbers);
}

TEST(GhostContacts, NoneOnAGridOfMixedWinding) {
  expect_only_the_planes_normal(mixed_grid(), 50, Joined::ByVertexNumbers);
}

TEST(GhostContacts, NoneOnAnIrregularGrid) {
  expect_only_the_planes_normal(irregular_grid(), 50, Joined::ByVertexNumbers);
}

TEST(GhostContacts, NoneOnTrianglesWithoutCommonVertices) {
  expect_only_the_planes_normal(shattered_grid(), 12, Joined::ByPlaceOnly);
}

TEST(GhostContacts, NoneWhereVerticesMeetEdges) {
  expect_only_the_planes_normal(rows_with_t_junctions(), 50, Joined::ByPlaceOnly);
}

TEST(GhostContacts, NoneBetweenFlushTiles) {
  expect_only_the_planes_normal(tiles(), 50, Joined::ByPlaceOnly);
}

TEST(GhostContacts, ATiltedCubeKeepsThePlanesNormal) {
  const TriangleMesh mesh = plain_grid().mesh();
  const Box cube(Vector3(0.5, 0.5, 0.5));
  std::mt19937_64 random(9);
  for (int k = 0; k < 200; ++k) {
    const Quaternion tilt(
        Eigen::AngleAxisd(random_number(0, 0.015, random), testing::random_direction(random)));
    const Quaternion turn(Eigen::AngleAxisd(random_number(0, 6, random), Vector3::UnitZ()));
    const RigidPose X_WB(tilt * turn, Vector3(random_number(-3, 3, random), 0.1, 0.52));
    const auto contacts = generate_contacts(mesh, RigidPose(), cube, X_WB, 0.1);
    EXPECT_EQ(contacts.size(), 4u);
    for (const ContactPoint& contact : contacts) EXPECT_GT(contact.nhat_AB_W.z(), 1 - 1e-12);
  }
}

}  // namespace
}  // namespace dyop
