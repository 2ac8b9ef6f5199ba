// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/shape_oracle.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/oracles/mesh_intersection_oracle.h"

namespace dyop::testing {
namespace {

using testing::box_mesh;
using testing::icosphere;
using testing::needle;
using testing::point_cloud;
using testing::random_soup;
using testing::torus;

// Both orders, and the fast oracle on the same pair.
void expect_distance(long double expected, const Shape& a, const RigidPose& X_WA, const Shape& b,
                     const RigidPose& X_WB) {
  for (const OracleDistance& d :
       {oracle_distance(a, X_WA, b, X_WB), oracle_distance(b, X_WB, a, X_WA)}) {
    EXPECT_NEAR(double(d.distance), double(expected), 1e-15 * double(1 + expected));
    EXPECT_LE(d.error, 1e-17L * (1 + expected));
  }
  const OracleBody body_a(a);
  const OracleBody body_b(b);
  PairSeed seed;
  const DistanceBracket fast = fast_oracle_distance(body_a, X_WA, body_b, X_WB, {}, seed);
  if (!oracle_contains(a, X_WA, b, X_WB)) {
    EXPECT_LE(fast.lower, double(expected) + 1e-15);
    EXPECT_GE(fast.upper, double(expected) - 1e-15);
    EXPECT_NEAR(fast.upper, fast.lower, 1e-11 * double(1 + expected));
  }
}

TEST(ShapeOracle, MeasuresSpheresAndCapsules) {
  // Centers 13 apart.
  expect_distance(13 - 1.5L, Sphere(1), at(0, 0, 0), Sphere(0.5), at(3, 4, 12));
  // The end of the core at z = 2 and the center at z = 6.
  expect_distance(4 - 1.5L, Capsule(0.5, 2), at(0, 0, 0), Sphere(1), at(0, 0, 6));
  expect_distance(0, Sphere(1), at(0, 0, 0), Sphere(1), at(1, 0, 0));
}

TEST(ShapeOracle, MeasuresBoxes) {
  const Box box(Vector3(1, 1, 1));
  // Corner to corner: (1, 1, 1) to (2, 3, 3).
  expect_distance(3, box, at(0, 0, 0), box, at(3, 4, 4));
  // A box turned by 45 degrees about z reaches sqrt(2) along x.
  const Quaternion turn(Eigen::AngleAxisd(std::atan(1.0), Vector3::UnitZ()));
  expect_distance(4 - std::sqrt(2.0L), box, at(0, 0, 0), box, RigidPose(turn, Vector3(5, 0, 0)));
  expect_distance(0.5L, box, at(0, 0, 0), Sphere(1.5), at(0, 3, 0));
}

TEST(ShapeOracle, CountsContainmentInASolidAsOverlap) {
  const Box large(Vector3(9, 9, 9));
  const Box small(Vector3(1, 1, 1));
  const TriangleMesh mesh = box_mesh(Vector3(1, 1, 1)).mesh();
  expect_distance(0, large, at(0, 0, 0), small, at(3, 0, 0));
  expect_distance(0, large, at(0, 0, 0), Sphere(1), at(3, 0, 0));
  expect_distance(0, large, at(0, 0, 0), mesh, at(0, 0, 0));
  // One of several parts inside is enough.
  expect_distance(0, large, at(7, 7, 7), point_cloud(40, 5).mesh(), at(-1.5, -1.5, -1.5));
}

TEST(ShapeOracle, SeesTheHollowOfAMesh) {
  const TriangleMesh mesh = box_mesh(Vector3(9, 9, 9)).mesh();
  expect_distance(5, mesh, at(0, 0, 0), Box(Vector3(1, 1, 1)), at(3, 0, 0));
  expect_distance(4.5L, mesh, at(0, 0, 0), Sphere(1.5), at(3, 0, 0));
  expect_distance(5, mesh, at(0, 0, 0), box_mesh(Vector3(1, 1, 1)).mesh(), at(3, 0, 0));
}

TEST(ShapeOracle, KeepsItsDigitsFarFromTheOrigin) {
  const TriangleMesh a = box_mesh(Vector3(1, 1, 1)).mesh();
  const OracleDistance d = oracle_distance(a, at(0x1p40, 0, 0), a, at(0x1p40 + 2 + 0x1p-10, 0, 0));
  EXPECT_NEAR(double(d.distance), 0x1p-10, 1e-18);
  EXPECT_LE(d.error, 1e-18L);
}

// Exhaustion over all pairs without boxes and without poses.
TEST(ShapeOracle, AgreesWithExhaustionOverTriangles) {
  std::mt19937_64 random(11);
  for (const auto& [a, b] : {std::pair{random_soup(60, 0.2, 1), random_soup(60, 0.2, 2)},
                             std::pair{needle(2, 9), point_cloud(60, 3)},
                             std::pair{icosphere(1), torus(1, 0.3, 8, 6)}}) {
    const TriangleMesh mesh_a = a.mesh();
    const TriangleMesh mesh_b = b.mesh();
    const Vector3 shift = random_vector(3, random);
    long double lower = 1e300L;
    long double upper = 1e300L;
    for (const TriangleIndices& s : a.triangles) {
      for (const TriangleIndices& t : b.triangles) {
        Triangle of_a;
        Triangle of_b;
        for (std::size_t k = 0; k < 3; ++k) {
          of_a[k] = a.vertices[std::size_t(s[k])];
          of_b[k] = b.vertices[std::size_t(t[k])] + shift;
        }
        const OracleDistance d = oracle_triangle_distance(of_a, of_b);
        lower = std::min(lower, d.lower());
        upper = std::min(upper, d.upper());
      }
    }
    const OracleDistance d = oracle_distance(mesh_a, RigidPose(), mesh_b, RigidPose(shift));
    EXPECT_LE(d.lower(), upper + 1e-15L);
    EXPECT_GE(d.upper(), lower - 1e-15L);
  }
}

TEST(ShapeOracle, FastAndSlowAgreeOnRandomMeshes) {
  std::mt19937_64 random(12);
  const TriangleMesh soup = random_soup(300, 0.2, 4).mesh();
  const TriangleMesh ring = torus(1, 0.3, 24, 12).mesh();
  const TriangleMesh ball = icosphere(2).mesh();
  const std::vector<const TriangleMesh*> meshes{&soup, &ring, &ball};
  int touching = 0;
  int count = 0;
  for (const TriangleMesh* a : meshes) {
    const OracleBody body_a(*a);
    for (const TriangleMesh* b : meshes) {
      const OracleBody body_b(*b);
      for (int k = 0; k < 6; ++k) {
        const RigidPose X_WA = random_pose(1.7, random);
        const RigidPose X_WB = random_pose(1.7, random);
        const OracleDistance slow = oracle_distance(*a, X_WA, *b, X_WB);
        PairSeed seed{std::int32_t(random_index(200, random)), 0};
        const DistanceBracket fast = fast_oracle_distance(body_a, X_WA, body_b, X_WB, {}, seed);
        EXPECT_LE(fast.lower, double(slow.upper()));
        EXPECT_GE(fast.upper, double(slow.lower()));
        EXPECT_LE(fast.upper - fast.lower, 1e-12);
        const DistanceBracket rough =
            fast_oracle_distance(body_a, X_WA, body_b, X_WB, {0.01, 0.1, 0.5}, seed);
        EXPECT_LE(rough.lower, double(slow.upper()));
        EXPECT_GE(rough.upper, double(slow.lower()));
        EXPECT_LE(rough.upper - rough.lower, 0.01 + 0.1 * std::max(0.0, rough.upper - 0.5));
        ++count;
        const bool is_touching = slow.upper() < 1e-20L;
        if (is_touching) ++touching;
        // Poses in double move vertices by about 1e-15: the two may differ closer than that only.
        const bool by_cgal = oracle_meshes_intersect(*a, X_WA, *b, X_WB);
        EXPECT_TRUE(by_cgal == is_touching || slow.upper() < 1e-13L);
      }
    }
  }
  EXPECT_GT(touching, count / 5);
  EXPECT_LT(touching, count - count / 5);
}

TEST(ShapeOracle, IntersectsSegmentsAndPointsOfMeshes) {
  const TriangleMesh sheet = box_mesh(Vector3(1, 1, 1)).mesh();
  const TriangleMesh rod = needle(4, 2).mesh();
  EXPECT_TRUE(oracle_meshes_intersect(sheet, RigidPose(), rod, at(0.1, 0.2, 0)));
  EXPECT_FALSE(oracle_meshes_intersect(sheet, RigidPose(), rod, at(0.1, 0.2, 1.001)));
  EXPECT_TRUE(oracle_meshes_intersect(rod, RigidPose(), rod, at(0, 0, 4)));
  EXPECT_FALSE(oracle_meshes_intersect(rod, RigidPose(), rod, at(0, 0.001, 0)));
}

TEST(ShapeOracle, TakesSecondsForFiveThousandTriangles) {
  const TriangleMesh ball = icosphere(4).mesh();  // 5120
  const auto start = std::chrono::steady_clock::now();
  const OracleDistance d = oracle_distance(ball, RigidPose(), ball, at(2.5, 0.3, 0.1));
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  RecordProperty("seconds", std::to_string(spent.count()));
  EXPECT_NEAR(double(d.distance), std::sqrt(2.5 * 2.5 + 0.3 * 0.3 + 0.01) - 2, 0.01);
  // A generous limit: an accidental 0.05 ms for every pair would take twenty minutes.
  EXPECT_LT(spent.count(), 60);
}

}  // namespace
}  // namespace dyop::testing
