// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "dyop/core/error.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::box_mesh;
using testing::gear;
using testing::icosphere;
using testing::MeshArrays;
using testing::plate_grid;
using testing::torus;

// The sum of the signed solid angles of all triangles over 4 pi ([VanOosterom1983]); an integer up
// to rounding, away from the surface.
Scalar by_solid_angles(const MeshArrays& mesh, const Vector3& p) {
  Scalar sum = 0;
  for (const TriangleIndices& t : mesh.triangles) {
    const Vector3 a = mesh.vertices[std::size_t(t[0])] - p;
    const Vector3 b = mesh.vertices[std::size_t(t[1])] - p;
    const Vector3 c = mesh.vertices[std::size_t(t[2])] - p;
    const Scalar x = a.norm(), y = b.norm(), z = c.norm();
    sum +=
        2 * std::atan2(a.cross(b).dot(c), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return sum / (4 * std::numbers::pi);
}

MeshArrays joined(const MeshArrays& x, const MeshArrays& y) {
  MeshArrays both = x;
  const auto offset = std::int32_t(x.vertices.size());
  both.vertices.insert(both.vertices.end(), y.vertices.begin(), y.vertices.end());
  for (const TriangleIndices& t : y.triangles) {
    both.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  return both;
}

MeshArrays inside_out(MeshArrays mesh) {
  for (TriangleIndices& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

Matrix3 turn() {
  return Eigen::AngleAxis<Scalar>(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
}

TEST(WindingNumber, AgreesWithSolidAnglesAtRandomPoints) {
  const std::vector<MeshArrays> meshes = {icosphere(2),
                                          torus(1, 0.4, 24, 12),
                                          gear(9, 0.7, 1, 0.3),
                                          box_mesh(Vector3(1, 0.5, 0.25)),
                                          joined(icosphere(2), torus(1, 0.4, 24, 12)),
                                          joined(icosphere(2), inside_out(icosphere(1, 0.5)))};
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<Scalar> uniform(-1.5, 1.5);
  int inside = 0, checked = 0;
  for (const MeshArrays& base : meshes) {
    for (const auto& [scale, offset] :
         {std::pair(1.0, 0.0), std::pair(1e-4, 0.0), std::pair(1e4, 0.0), std::pair(1.0, 1e5)}) {
      const Vector3 far = offset * Vector3(1, -2, 3);
      const MeshArrays moved = base.moved(turn(), far, scale);
      const TriangleMesh mesh = moved.mesh();
      for (int i = 0; i < 300; ++i) {
        const Vector3 q(uniform(engine), uniform(engine), uniform(engine));
        const Vector3 p = far + scale * (turn() * q);
        const Scalar expected = by_solid_angles(moved, p);
        // literal: nearer to the surface than rounding far from the origin
        if (std::abs(expected - std::round(expected)) > 1e-6) continue;
        ++checked;
        inside += std::round(expected) != 0;
        ASSERT_EQ(winding_number(mesh, p), std::lround(expected)) << p.transpose();
        ASSERT_EQ(contains(mesh, p), std::lround(expected) != 0);
      }
    }
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(checked, 7000);
}

// Points whose ray meets vertices, edges in line with the axes, and diagonals of faces.
TEST(WindingNumber, CountsRaysThroughVerticesAndEdgesOnce) {
  const MeshArrays box = box_mesh(Vector3(1, 1, 1));
  const TriangleMesh mesh = box.mesh();
  for (Scalar x = -1.5; x <= 1.5; x += 0.25) {
    for (Scalar y = -1.5; y <= 1.5; y += 0.25) {
      for (const Scalar z : {-1.25, -0.5, 0.0, 0.75, 1.5}) {
        const Vector3 p(x, y, z);
        const Scalar largest = p.cwiseAbs().maxCoeff();
        if (largest == 1) continue;  // on the surface
        EXPECT_EQ(winding_number(mesh, p), largest < 1 ? 1 : 0) << p.transpose();
      }
    }
  }
  const MeshArrays sphere = icosphere(3);
  const TriangleMesh round = sphere.mesh();
  for (const Vector3& v : sphere.vertices) {
    EXPECT_EQ(winding_number(round, Vector3(v.x(), v.y(), -2)), 0);
    EXPECT_EQ(winding_number(round, 0.5 * v), 1);
    // Above the origin's height: the ray passes through the vertex itself.
    if (v.z() > 0.5) {
      EXPECT_EQ(winding_number(round, Vector3(v.x(), v.y(), 0)), 1);
    }
  }
}

TEST(WindingNumber, OnTheSurfaceIsThatOfOneOfItsSides) {
  const MeshArrays sphere = icosphere(2);
  const TriangleMesh mesh = sphere.mesh();
  for (const Vector3& v : sphere.vertices) {
    const int winding = winding_number(mesh, v);
    EXPECT_TRUE(winding == 0 || winding == 1) << v.transpose();
  }
}

TEST(WindingNumber, CountsLayersAndDirection) {
  const MeshArrays nested = joined(icosphere(2), icosphere(2, 0.5));
  EXPECT_EQ(winding_number(nested.mesh(), Vector3::Zero()), 2);
  EXPECT_EQ(winding_number(nested.mesh(), Vector3(0, 0.7, 0)), 1);
  const MeshArrays hollow = joined(icosphere(2), inside_out(icosphere(2, 0.5)));
  EXPECT_EQ(winding_number(hollow.mesh(), Vector3::Zero()), 0);
  EXPECT_EQ(winding_number(inside_out(icosphere(2)).mesh(), Vector3::Zero()), -1);
  EXPECT_TRUE(contains(inside_out(icosphere(2)).mesh(), Vector3::Zero()));
}

TEST(WindingNumber, RefusesMeshesWithoutAnInsideAndPointsThatAreNone) {
  const auto message = [](const TriangleMesh& mesh, const Vector3& p) {
    return testing::message_of([&] { contains(mesh, p); });
  };
  EXPECT_NE(message(plate_grid(1, 1, 2, 2).mesh(), Vector3::Zero()).find("only a closed mesh"),
            std::string::npos);
  EXPECT_EQ(message(box_mesh(Vector3::Ones()).mesh(), Vector3(0, std::nan(""), 0)),
            "point must be finite, not (0 nan 0)");
}

// Points so far from a mesh so small that their ratio overflows.
TEST(WindingNumber, OfPointsFarBeyondASmallMeshIsZero) {
  for (const Scalar size : {1e-50, 1e-10, 1.0}) {
    const TriangleMesh mesh = box_mesh(Vector3::Constant(size)).mesh();
    EXPECT_EQ(winding_number(mesh, size * Vector3(0.1, 0.2, 0.3)), 1) << size;
    for (const Scalar far : {1e100, 1e300}) {
      EXPECT_EQ(winding_number(mesh, Vector3(0.1 * size, 0.2 * size, -far)), 0) << size;
      EXPECT_EQ(winding_number(mesh, Vector3(0.1 * size, 0.2 * size, far)), 0) << size;
    }
  }
}

TEST(WindingNumber, PartVerticesAreOneOfEachPart) {
  const MeshArrays two = joined(icosphere(1), box_mesh(Vector3::Ones()));
  const TriangleMesh mesh = two.mesh();
  const auto parts = mesh.part_vertices();
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_LT(parts[0], 42) << "the sphere's vertices come first";
  EXPECT_GE(parts[1], 42);
  const TriangleMesh points = testing::point_cloud(7, 1).mesh();
  EXPECT_EQ(points.part_vertices().size(), 7u);
}

}  // namespace
}  // namespace dyop
