// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::MeshArrays;

// A sheet whose vertices move at random, and a ball near it.
struct DistanceCase {
  DeformingMesh sheet;
  TriangleMesh ball;
  RigidPose X_WB;
  Scalar s;
  Scalar size;
};

DistanceCase random_distance_case(Scalar scale, Scalar offset, std::mt19937_64& random) {
  const Vector3 place = offset * testing::random_direction(random);
  const MeshArrays sheet =
      testing::plate_grid(2, 2, 6, 6)
          .moved(testing::random_rotation(random).toRotationMatrix(), place, scale);
  std::vector<Vector3> end = sheet.vertices;
  for (Vector3& p : end) p += scale * testing::random_vector(0.5, random);
  const Vector3 beside =
      place + scale * testing::random_number(0, 3, random) * testing::random_direction(random);
  const RigidPose X_WB(testing::random_rotation(random), beside);
  return {DeformingMesh(sheet.vertices, end, sheet.triangles),
          testing::icosphere(1).moved(Matrix3::Identity(), Vector3::Zero(), 0.5 * scale).mesh(),
          X_WB, testing::random_number(0, 1, random), 4 * scale + offset};
}

// Against distance() of the mesh that stands where the deforming one is.
TEST(DeformingDistance, IsThatOfTheSnapshot) {
  std::mt19937_64 random(81);
  int apart = 0;
  for (const auto& [scale, offset] :
       {std::pair<Scalar, Scalar>{1, 0}, {1e-4, 0}, {1e4, 0}, {1, 1e5}}) {
    for (int k = 0; k < 150; ++k) {
      const DistanceCase c = random_distance_case(scale, offset, random);
      DistanceCache cache;
      for (const Scalar s : {c.s, 0.0, 1.0, c.s}) {  // the cache starts elsewhere than it ends
        const DistanceResult found = distance(c.sheet, s, c.ball, c.X_WB, {}, cache);
        const DistanceResult truth =
            distance(c.sheet.snapshot(s), RigidPose(), c.ball, c.X_WB, DistanceOptions{});
        const Scalar noise = 64 * kPoseNoise * c.size;
        EXPECT_LE(found.lower, truth.upper + noise);
        EXPECT_GE(found.upper, truth.lower - noise);
        EXPECT_LE(found.upper - found.lower, noise);
        EXPECT_LE((found.p_WCb - found.p_WCa).norm(), found.upper + noise);
        apart += found.lower > 0;
      }
    }
  }
  EXPECT_GT(apart, 1000);
}

TEST(DeformingDistance, NearPairsAreAllPairsWithinReach) {
  std::mt19937_64 random(82);
  std::size_t most = 0;
  for (int k = 0; k < 60; ++k) {
    const DistanceCase c = random_distance_case(1, 0, random);
    const Scalar reach = testing::random_number(0.05, 0.6, random);
    DistanceCache cache;
    std::vector<WitnessPair> pairs;
    find_near_pairs(c.sheet, c.s, c.ball, c.X_WB, reach, 100000, cache, pairs);
    const TriangleMesh snapshot = c.sheet.snapshot(c.s);
    std::size_t sure = 0;
    std::size_t possible = 0;
    for (std::size_t i = 0; i < snapshot.triangles().size(); ++i) {
      const TriangleMesh one(
          std::vector<Vector3>(snapshot.vertices().begin(), snapshot.vertices().end()),
          {snapshot.triangles()[i]});
      for (const TriangleIndices& other : c.ball.triangles()) {
        const TriangleMesh two(
            std::vector<Vector3>(c.ball.vertices().begin(), c.ball.vertices().end()), {other});
        const DistanceResult d = distance(one, RigidPose(), two, c.X_WB, DistanceOptions{});
        sure += d.upper < reach * (1 - 1e-12);
        possible += d.lower < reach * (1 + 1e-12);
      }
    }
    EXPECT_GE(pairs.size(), sure);
    EXPECT_LE(pairs.size(), possible);
    for (const WitnessPair& pair : pairs) EXPECT_LE(pair.lower, reach);
    most = std::max(most, pairs.size());
    if (pairs.size() < 3) continue;
    find_near_pairs(c.sheet, c.s, c.ball, c.X_WB, reach, 2, cache, pairs);
    EXPECT_EQ(pairs.size(), 2u);
  }
  EXPECT_GT(most, 50u);
}

TEST(DeformingDistance, RefusesFractionsAndReachesOutOfRange) {
  std::mt19937_64 random(83);
  const DistanceCase c = random_distance_case(1, 0, random);
  DistanceCache cache;
  std::vector<WitnessPair> pairs;
  for (const Scalar s : {-0.1, 1.1, std::nan("")}) {
    EXPECT_THROW(distance(c.sheet, s, c.ball, c.X_WB, {}, cache), InvalidArgument);
    EXPECT_THROW(find_near_pairs(c.sheet, s, c.ball, c.X_WB, 1, 9, cache, pairs), InvalidArgument);
  }
  for (const Scalar reach : {-1.0, kInfinity, std::nan("")}) {
    EXPECT_THROW(find_near_pairs(c.sheet, 0.5, c.ball, c.X_WB, reach, 9, cache, pairs),
                 InvalidArgument);
  }
}

}  // namespace
}  // namespace dyop
