// SPDX-License-Identifier: BSD-3-Clause

// Meshes whose vertices are far from their frame's origin, as in map coordinates, are answered like
// the same meshes about the origin, with as much work.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/distance/point_distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::icosphere;
using testing::MeshArrays;
using testing::random_vector;
using testing::torus;

// Eastings, northings and heights in metres.
const Vector3 kOnTheMap(3.2e5, 4.5e6, 812.5);

// How far apart the bounds may be for rounding: 400 units in the last place of map coordinates.
constexpr Scalar kRounding = 4e-7;

MeshArrays on_the_map(const MeshArrays& mesh) {
  return mesh.moved(Matrix3::Identity(), kOnTheMap);
}

// Where a mesh on the map lies as the one about the origin does at X_WS.
RigidPose from_the_map(const RigidPose& X_WS) {
  return X_WS * RigidPose(Vector3(-kOnTheMap));
}

TEST(GeoreferencedMesh, HasTheDistanceOfOneAboutTheOrigin) {
  std::mt19937_64 random(5);
  const MeshArrays ball = icosphere(4);
  const MeshArrays ring = torus(1, 0.3, 60, 30);
  const TriangleMesh near_ball = ball.mesh();
  const TriangleMesh near_ring = ring.mesh();
  const TriangleMesh far_ball = on_the_map(ball).mesh();
  const TriangleMesh far_ring = on_the_map(ring).mesh();
  std::int64_t near_work = 0;
  std::int64_t far_work = 0;
  for (int k = 0; k < 200; ++k) {
    const RigidPose X_WA(testing::random_pose(0.1, random));
    // Turning a frame on the map moves what it holds by as much as it is away: turn about the mesh.
    const RigidPose X_WB(X_WA.rotation(), 2.5 * random_vector(1, random));
    const DistanceResult wanted = distance(near_ball, X_WA, near_ring, X_WB);
    const DistanceResult found =
        distance(far_ball, from_the_map(X_WA), far_ring, from_the_map(X_WB));
    ASSERT_EQ(found.status, wanted.status) << k;
    near_work += wanted.statistics.leaf_tests;
    far_work += found.statistics.leaf_tests;
    if (wanted.status == DistanceStatus::Overlapping) continue;
    EXPECT_LE(found.lower, wanted.upper + kRounding) << k;
    EXPECT_GE(found.upper, wanted.lower - kRounding) << k;
    EXPECT_NEAR(found.lower, found.upper, kRounding) << k;
  }
  EXPECT_LE(far_work, near_work + near_work / 10);
}

TEST(GeoreferencedMesh, MeetsWhenOneAboutTheOriginDoes) {
  std::mt19937_64 random(6);
  const MeshArrays ball = icosphere(4);
  const TriangleMesh near_mesh = ball.mesh();
  const TriangleMesh far_mesh = on_the_map(ball).mesh();
  std::int64_t near_work = 0;
  std::int64_t far_work = 0;
  for (int k = 0; k < 100; ++k) {
    const Vector3 start = testing::random_direction(random) * 4;
    const Vector3 velocity = -start + random_vector(1.2, random);
    const RestMotion rest;
    const RestMotion rest_on_the_map(from_the_map(RigidPose()));
    const ToiResult wanted =
        time_of_impact(near_mesh, testing::moving(RigidPose(start), velocity, Vector3::Zero()),
                       near_mesh, rest, {0, 1});
    const ToiResult found = time_of_impact(
        far_mesh, testing::moving(from_the_map(RigidPose(start)), velocity, Vector3::Zero()),
        far_mesh, rest_on_the_map, {0, 1});
    near_work += wanted.statistics.node_pairs;
    far_work += found.statistics.node_pairs;
    ASSERT_EQ(found.status, wanted.status) << k;
    if (wanted.status == ToiStatus::Impact) {
      EXPECT_NEAR(found.t_safe, wanted.t_safe, 2e-5) << k;
    }
  }
  EXPECT_LE(far_work, near_work + near_work / 10);
}

TEST(GeoreferencedMesh, AnswersPointsAndRays) {
  std::mt19937_64 random(7);
  const MeshArrays ring = torus(1, 0.3, 60, 30);
  const TriangleMesh near_mesh = ring.mesh();
  const TriangleMesh far_mesh = on_the_map(ring).mesh();
  const PointDistanceOptions is_signed{.is_signed = true};
  for (int k = 0; k < 2000; ++k) {
    const Vector3 p = random_vector(2, random);
    const PointDistance wanted = point_distance(near_mesh, RigidPose(), p, is_signed);
    const PointDistance found = point_distance(far_mesh, from_the_map(RigidPose()), p, is_signed);
    EXPECT_NEAR(found.lower, wanted.lower, kRounding) << k;
    EXPECT_NEAR(found.upper, wanted.upper, kRounding) << k;
    const Ray ray{.p_W = p, .direction_W = testing::random_direction(random), .length = 5};
    const RayHit hit = ray_cast(near_mesh, RigidPose(), ray);
    const RayHit far_hit = ray_cast(far_mesh, from_the_map(RigidPose()), ray);
    // A ray along an edge may hit or miss; one that grazes may touch a little earlier or later.
    if (hit.status == far_hit.status) {
      const Scalar cosine = std::abs(hit.nhat_W.dot(ray.direction_W));
      EXPECT_LE(std::abs(far_hit.distance - hit.distance) * cosine, kRounding) << k;
    }
  }
}

TEST(GeoreferencedMesh, IsFoundInCompounds) {
  std::mt19937_64 random(8);
  const auto ball = std::make_shared<TriangleMesh>(icosphere(3).mesh());
  const auto far_ball = std::make_shared<TriangleMesh>(on_the_map(icosphere(3)).mesh());
  const auto box = std::make_shared<Box>(Vector3(1, 0.2, 0.4));
  std::vector<CompoundChild> near_children;
  std::vector<CompoundChild> far_children;
  for (int k = 0; k < 20; ++k) {
    const RigidPose X_CS = testing::random_pose(10, random);
    const RigidPose straight(X_CS.translation());
    near_children.push_back({ball, straight});
    far_children.push_back({far_ball, straight});  // stays on the map
    near_children.push_back({box, X_CS});
    far_children.push_back({box, RigidPose(kOnTheMap) * X_CS});
  }
  const CompoundShape near_shape(near_children);
  const CompoundShape far_shape(far_children);
  const TriangleMesh probe = icosphere(2, 0.4).mesh();
  std::int64_t near_work = 0;
  std::int64_t far_work = 0;
  for (int k = 0; k < 200; ++k) {
    const RigidPose X_WB = testing::random_pose(12, random);
    const DistanceResult wanted = distance(near_shape, RigidPose(), probe, X_WB);
    const DistanceResult found = distance(far_shape, from_the_map(RigidPose()), probe, X_WB);
    near_work += wanted.statistics.box_tests;
    far_work += found.statistics.box_tests;
    ASSERT_EQ(found.status, wanted.status) << k;
    EXPECT_NEAR(found.lower, wanted.lower, kRounding) << k;
    EXPECT_NEAR(found.upper, wanted.upper, kRounding) << k;
  }
  EXPECT_LE(far_work, near_work + near_work / 10);
}

TEST(GeoreferencedMesh, ChangesNoDefaultTolerance) {
  const TriangleMesh near_mesh = icosphere(2).mesh();
  const TriangleMesh far_mesh = on_the_map(icosphere(2)).mesh();
  EXPECT_NEAR(default_distance_tolerance(near_mesh, near_mesh), 1e-6, 1e-12);
  EXPECT_LE(default_distance_tolerance(far_mesh, far_mesh), 8e-6);
}

}  // namespace
}  // namespace dyop
