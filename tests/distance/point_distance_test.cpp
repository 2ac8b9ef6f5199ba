// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/point_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/tolerance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/all_shapes.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/oracles/shape_oracle.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

using testing::all_shapes;
using testing::box_mesh;
using testing::gear;
using testing::icosphere;
using testing::MeshArrays;
using testing::needle;
using testing::plate_grid;
using testing::point_cloud;
using testing::random_soup;
using testing::torus;

TriangleMesh point_mesh(const Vector3& p) {
  return TriangleMesh({p}, {{0, 0, 0}});
}

// The surface's signed distance from the definition: all triangles, and the sum of their solid
// angles.
int slow_winding(const TriangleMesh& mesh, const Vector3& p) {
  Scalar sum = 0;
  for (std::size_t k = 0; k < mesh.triangles().size(); ++k) {
    const Triangle v = mesh.triangle(static_cast<std::int32_t>(k));
    const Vector3 a = v[0] - p;
    const Vector3 b = v[1] - p;
    const Vector3 c = v[2] - p;
    sum += 2 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return static_cast<int>(std::lround(sum / (4 * std::numbers::pi)));
}

// The bounds hold, are tight, and the witness lies on the surface where the normal says.
void expect_right(const PointDistance& found, const OracleDistance& oracle, Scalar size,
                  const std::string& name) {
  EXPECT_LE(found.lower, oracle.upper()) << name;
  EXPECT_GE(found.upper, oracle.lower()) << name;
  EXPECT_LE(found.upper - found.lower, 512 * kUnitRoundoff * size) << name;
  EXPECT_NEAR(found.nhat_W.norm(), 1, 8 * kUnitRoundoff) << name;
}

std::vector<MeshArrays> all_meshes() {
  return {icosphere(2), torus(1, 0.4, 16, 8), box_mesh({1, 0.5, 0.2}), plate_grid(2, 1, 6, 4),
          needle(2, 6), point_cloud(40, 3),   random_soup(60, 0.3, 5), gear(9, 0.8, 1, 0.2)};
}

TEST(PointDistance, OfMeshesAgreesWithBruteForceAtAllScales) {
  std::mt19937_64 random(11);
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    for (const Scalar far : {0.0, 1e3}) {
      for (const MeshArrays& arrays : all_meshes()) {
        const TriangleMesh mesh = arrays.moved(Matrix3::Identity(), Vector3::Zero(), scale).mesh();
        for (int k = 0; k < 6; ++k) {
          const RigidPose X_WS(random_rotation(random), far * scale * random_direction(random));
          const Vector3 p_W = X_WS * Vector3(random_vector(scale * (k % 2 ? 1 : 3), random));
          const PointDistance found = point_distance(mesh, X_WS, p_W);
          const Scalar size = X_WS.translation().norm() + p_W.norm() + mesh.bounding_radius();
          expect_right(found, oracle_distance(mesh, X_WS, point_mesh(p_W), RigidPose()), size, "");
          EXPECT_NEAR((p_W - found.p_WC).norm(), found.upper, 512 * kUnitRoundoff * size);
          ASSERT_TRUE(found.triangle);
          const OracleDistance on_surface =
              oracle_distance(mesh, X_WS, point_mesh(found.p_WC), RigidPose());
          EXPECT_LE(on_surface.lower(), 512 * kUnitRoundoff * size);
        }
      }
    }
  }
}

TEST(PointDistance, NamesTheTriangleAndFeatureThatAreNearest) {
  std::mt19937_64 random(12);
  const TriangleMesh mesh = torus(1, 0.4, 16, 8).mesh();
  int faces = 0;
  int edges = 0;
  int corners = 0;
  for (int k = 0; k < 400; ++k) {
    const Vector3 p = random_vector(1.5, random);
    const PointDistance found = point_distance(mesh, RigidPose(), p);
    ASSERT_TRUE(found.triangle);
    const OracleDistance named =
        oracle_triangle_distance({p, p, p}, mesh.triangle(*found.triangle));
    EXPECT_NEAR(static_cast<Scalar>(named.distance), found.upper, 1e-13);
    std::vector<Vector3> corner;
    for (std::size_t i = 0; i < found.feature.vertex_count(); ++i) {
      corner.push_back(mesh.vertices()[static_cast<std::size_t>(found.feature.vertices[i])]);
    }
    const std::size_t last = corner.size() - 1;
    const Triangle feature{corner[0], corner[std::min<std::size_t>(1, last)], corner[last]};
    const OracleDistance at_feature = oracle_triangle_distance({p, p, p}, feature);
    EXPECT_NEAR(static_cast<Scalar>(at_feature.distance), found.upper, 1e-13);
    faces += found.feature.kind == FeatureKind::Face;
    edges += found.feature.kind == FeatureKind::Edge;
    corners += found.feature.kind == FeatureKind::Vertex;
  }
  EXPECT_GT(faces, 50);
  EXPECT_GT(edges, 20);
  EXPECT_GT(corners, 10);
}

TEST(PointDistance, IsZeroOnTheSurface) {
  std::mt19937_64 random(13);
  for (const MeshArrays& arrays : all_meshes()) {
    const TriangleMesh mesh = arrays.mesh();
    for (int k = 0; k < 40; ++k) {
      const auto number = static_cast<std::int32_t>(
          random_index(static_cast<int>(mesh.triangles().size()), random));
      const Triangle v = mesh.triangle(number);
      const Scalar s = k % 3 == 0 ? 0 : random_number(0, 1, random);
      const Scalar t = k % 4 == 0 ? 0 : random_number(0, 1 - s, random);
      const Vector3 p = v[0] + s * (v[1] - v[0]) + t * (v[2] - v[0]);
      const PointDistance found = point_distance(mesh, RigidPose(), p);
      EXPECT_LE(found.upper, 256 * kUnitRoundoff * (mesh.bounding_radius() + p.norm()));
      EXPECT_GE(found.lower, 0);
    }
  }
}

TEST(PointDistance, OfConvexShapesAgreesWithBruteForce) {
  std::mt19937_64 random(14);
  int inside = 0;
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    for (const auto& maker : all_shapes()) {
      const auto shape = maker.make(scale);
      if (!shape->core_surface()) continue;  // the oracle knows no smooth cores
      for (int k = 0; k < 20; ++k) {
        const RigidPose X_WS = random_pose(scale, random);
        const Vector3 p_W = X_WS * Vector3(random_vector(scale * (k % 2 ? 0.4 : 2), random));
        const PointDistance found = point_distance(*shape, X_WS, p_W);
        const OracleDistance oracle = oracle_distance(*shape, X_WS, point_mesh(p_W), RigidPose());
        const Scalar size = X_WS.translation().norm() + p_W.norm() + shape->bounding_radius();
        expect_right(found, oracle, size, maker.name);
        EXPECT_FALSE(found.triangle);
        EXPECT_NEAR((p_W - found.p_WC).norm(), found.upper, 1024 * kUnitRoundoff * size);
        inside += found.upper == 0;
      }
    }
  }
  EXPECT_GT(inside, 20);
}

TEST(PointDistance, IsNegativeInsideASolid) {
  std::mt19937_64 random(15);
  int inside = 0;
  for (const MeshArrays& arrays : {icosphere(2), torus(1, 0.4, 16, 8), gear(9, 0.8, 1, 0.2)}) {
    const TriangleMesh mesh = arrays.mesh();
    for (int k = 0; k < 60; ++k) {
      const Vector3 p = random_vector(1, random).cwiseProduct(Vector3(1, 1, k % 2 ? 0.2 : 1));
      const PointDistance found = point_distance(mesh, RigidPose(), p, {.is_signed = true});
      const PointDistance plain = point_distance(mesh, RigidPose(), p);
      const bool is_inside = slow_winding(mesh, p) != 0;
      EXPECT_EQ(found.lower, is_inside ? -plain.upper : plain.lower);
      EXPECT_EQ(found.upper, is_inside ? -plain.lower : plain.upper);
      EXPECT_EQ(found.nhat_W, is_inside ? Vector3(-plain.nhat_W) : plain.nhat_W);
      // The distance grows along the normal.
      const PointDistance outward =
          point_distance(mesh, RigidPose(), p + 1e-6 * found.nhat_W, {.is_signed = true});
      EXPECT_GT(outward.lower, found.upper);
      inside += is_inside;
    }
  }
  EXPECT_GT(inside, 20);
}

TEST(PointDistance, IsNegativeInsideConvexShapes) {
  const Box box({1, 2, 3});
  const PointDistance in_box =
      point_distance(box, RigidPose(), {0.75, 0.5, -1}, {.is_signed = true});
  EXPECT_NEAR(in_box.lower, -0.25, 1e-13);
  EXPECT_NEAR(in_box.upper, -0.25, 1e-13);
  EXPECT_LT((in_box.nhat_W - Vector3(1, 0, 0)).norm(), 1e-13);
  EXPECT_LT((in_box.p_WC - Vector3(1, 0.5, -1)).norm(), 1e-13);
  const Sphere sphere(2);
  const PointDistance in_sphere =
      point_distance(sphere, RigidPose(Vector3(5, 0, 0)), {5, 0.5, 0}, {.is_signed = true});
  EXPECT_NEAR(in_sphere.upper, -1.5, 1e-13);
  EXPECT_LT((in_sphere.p_WC - Vector3(5, 2, 0)).norm(), 1e-13);
  const PointDistance at_centre =
      point_distance(sphere, RigidPose(), {0, 0, 0}, {.is_signed = true});
  EXPECT_LE(at_centre.lower, -2);
  EXPECT_NEAR(at_centre.upper, -2, 1e-13);
  const Capsule capsule(0.5, 1);
  const PointDistance in_capsule =
      point_distance(capsule, RigidPose(), {0, 0.125, 0.5}, {.is_signed = true});
  EXPECT_NEAR(in_capsule.upper, -0.375, 1e-13);
  EXPECT_LE(in_capsule.lower, -0.375);
}

TEST(PointDistance, StopsAtTheLargestDistanceAsked) {
  const TriangleMesh mesh = icosphere(2).mesh();
  const PointDistance far = point_distance(mesh, RigidPose(), {3, 0, 0}, {.max_distance = 1});
  EXPECT_GT(far.lower, 1);
  EXPECT_LE(far.lower, 2);
  const PointDistance near = point_distance(mesh, RigidPose(), {1.5, 0, 0}, {.max_distance = 1});
  EXPECT_EQ(near.upper, point_distance(mesh, RigidPose(), {1.5, 0, 0}).upper);
  const PointDistance deep =
      point_distance(mesh, RigidPose(), Vector3::Zero(), {.max_distance = 0.1, .is_signed = true});
  EXPECT_LT(deep.upper, -0.1);
  EXPECT_LT(deep.lower, -0.95);
  const PointDistance in_box =
      point_distance(Box({1, 1, 1}), RigidPose(), Vector3::Zero(), {.max_distance = 0.1});
  EXPECT_EQ(in_box.lower, 0);
  EXPECT_EQ(in_box.upper, 0);
}

TEST(PointDistance, BatchGivesTheSameBitsForEveryThreadCount) {
  std::mt19937_64 random(16);
  const TriangleMesh mesh = torus(1, 0.4, 24, 12).mesh();
  const RigidPose X_WS = random_pose(1, random);
  std::vector<Vector3> points;
  for (int k = 0; k < 1500; ++k) points.push_back(random_vector(3, random));
  std::vector<PointDistance> results(points.size());
  for (const int threads : {1, 2, 5}) {
    std::size_t last_done = 0;
    BatchOptions batch;
    batch.thread_count = threads;
    batch.progress = [&](std::size_t done, std::size_t total) {
      EXPECT_GT(done, last_done);
      EXPECT_EQ(total, points.size());
      last_done = done;
    };
    point_distance_batch(mesh, X_WS, points, results, {.is_signed = true}, batch);
    EXPECT_EQ(last_done, points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PointDistance one = point_distance(mesh, X_WS, points[i], {.is_signed = true});
      ASSERT_EQ(results[i].lower, one.lower);
      ASSERT_EQ(results[i].upper, one.upper);
      ASSERT_EQ(results[i].p_WC, one.p_WC);
      ASSERT_EQ(results[i].nhat_W, one.nhat_W);
      ASSERT_EQ(results[i].triangle, one.triangle);
      ASSERT_EQ(results[i].feature, one.feature);
    }
  }
  std::stop_source source;
  source.request_stop();
  BatchOptions stopped;
  stopped.stop = source.get_token();
  point_distance_batch(mesh, X_WS, points, results, {}, stopped);
  EXPECT_EQ(results.back().upper, kInfinity);
}

TEST(PointDistance, RefusesBadInputByName) {
  const TriangleMesh open = plate_grid(1, 1, 2, 2).mesh();
  const RigidPose X;
  const auto with = [&](const Vector3& p, const PointDistanceOptions& options) {
    return message_of([&] { static_cast<void>(point_distance(open, X, p, options)); });
  };
  EXPECT_EQ(with({0, std::nan(""), 0}, {}),
            "point_distance: the point must be finite, not (0 nan 0)");
  EXPECT_EQ(with({0, 0, 0}, {.max_distance = -1}),
            "point_distance: max_distance must be >= 0, not -1");
  EXPECT_EQ(with({0, 0, 0}, {.is_signed = true}),
            "point_distance: is_signed is set, but the mesh is not closed");
  std::vector<Vector3> points(3, Vector3::Zero());
  std::vector<PointDistance> results(2);
  EXPECT_EQ(message_of([&] { point_distance_batch(open, X, points, results); }),
            "point_distance_batch: 3 points, but space for 2 results");
  results.resize(3);
  points[2].x() = kInfinity;
  EXPECT_EQ(message_of([&] { point_distance_batch(open, X, points, results); }),
            "point_distance_batch: point 2 must be finite, not (inf 0 0)");
}

// The kernel alone, on triangles that are hard for the certified one.
TEST(PointTriangleDistance, BoundsHoldOnEveryFamilyOfTriangles) {
  std::mt19937_64 random(17);
  for (const TriangleFamily family : kAllTriangleFamilies) {
    for (int k = 0; k < 200; ++k) {
      const TrianglePair pair = random_triangle_pair(family, random);
      const Vector3& p = pair.a[0];
      const distance_internal::PointTriangleDistance found =
          distance_internal::point_triangle_distance(p, pair.b);
      const OracleDistance oracle = oracle_triangle_distance({p, p, p}, pair.b);
      ASSERT_LE(found.lower, oracle.upper()) << name_of(family);
      ASSERT_GE(found.upper, oracle.lower()) << name_of(family);
      ASSERT_LE(found.upper - found.lower, 2 * triangle_noise({p, p, p}, pair.b))
          << name_of(family);
      ASSERT_NEAR(found.nhat_C.norm(), 1, 1e-12);
    }
  }
}

TEST(PointDistance, OfACloudIsThatOfItsNearestPoint) {
  std::mt19937_64 random(3);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    std::vector<Vector3> points;
    for (int i = 0; i < 500; ++i) points.push_back(size * random_direction(random));
    const CompoundShape cloud = dyop::point_cloud(points, 0.01 * size);
    for (int k = 0; k < 200; ++k) {
      const Vector3 p = 0.01 * k * size * random_direction(random);
      std::size_t nearest = 0;
      for (std::size_t i = 1; i < points.size(); ++i) {
        if ((points[i] - p).norm() < (points[nearest] - p).norm()) nearest = i;
      }
      const Scalar expected = std::max(0.0, (points[nearest] - p).norm() - 0.01 * size);
      const PointDistance found = point_distance(cloud, RigidPose(), p);
      EXPECT_LE(found.lower, expected * (1 + 1e-12));
      EXPECT_GE(found.upper, expected * (1 - 1e-12));
      EXPECT_LT(found.upper - found.lower, 1e-10 * size);
      const Vector3& of_child = points[std::size_t(found.child.value())];
      EXPECT_NEAR((of_child - p).norm(), (points[nearest] - p).norm(), 0.01 * size);
      PointDistanceOptions near;
      near.max_distance = 0.5 * expected;
      EXPECT_GE(point_distance(cloud, RigidPose(), p, near).lower, near.max_distance);
    }
  }
}

TEST(PointDistance, OfACompoundIsThatOfItsNearestChild) {
  const auto ball = std::make_shared<const Sphere>(1);
  const auto box = std::make_shared<const Box>(Vector3(1, 1, 1));
  const CompoundShape both({{ball, RigidPose()}, {box, RigidPose(Vector3(5, 0, 0))}});
  const PointDistance near_box = point_distance(both, RigidPose(), Vector3(5, 0, 3));
  EXPECT_NEAR(near_box.lower, 2, 1e-12);
  EXPECT_NEAR(near_box.upper, 2, 1e-12);
  EXPECT_EQ(near_box.child, 1);
  const PointDistance near_ball = point_distance(both, RigidPose(), Vector3(-3, 0, 0));
  EXPECT_NEAR(near_ball.upper, 2, 1e-12);
  EXPECT_EQ(near_ball.child, 0);
  PointDistanceOptions with_sign;
  with_sign.is_signed = true;
  EXPECT_THROW(point_distance(both, RigidPose(), Vector3::Zero(), with_sign), InvalidArgument);
}

}  // namespace
}  // namespace dyop::testing
