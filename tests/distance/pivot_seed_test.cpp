// SPDX-License-Identifier: BSD-3-Clause
#include "distance/pivot_seed.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/clear_stack.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::distance_internal {
namespace {

using namespace testing;

std::vector<std::shared_ptr<const Shape>> walked_shapes(Scalar s) {
  std::mt19937_64 random(6);
  std::vector<Vector3> points(32);
  for (Vector3& p : points) p = s * testing::random_vector(0.7, random);
  MeshArrays ring = torus(0.7 * s, 0.2 * s, 24, 12);
  MeshArrays soup = random_soup(60, 0.2, 3);
  for (Vector3& p : soup.vertices) p *= s;
  return {std::make_shared<Box>(s * Vector3(0.9, 0.5, 0.02)),
          std::make_shared<Capsule>(0.1 * s, 0.8 * s),
          std::make_shared<Sphere>(0.5 * s),
          std::make_shared<ConvexHull>(points),
          std::make_shared<TriangleMesh>(ring.mesh()),
          std::make_shared<TriangleMesh>(soup.mesh())};
}

// Calls check(a, X_WA, b, X_WB, seed) along a walk of every pair; the seed is the last query's,
// every tenth time what the pivot picks.
template <typename Check>
void walk_pairs(const Check& check) {
  std::mt19937_64 random(12);
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    const auto all = walked_shapes(s);
    for (const auto& a : all) {
      for (const auto& b : all) {
        const RigidPose X_WA(testing::random_rotation(random).toRotationMatrix(),
                             testing::random_vector(10 * s, random));
        Vector3 p_AB = 2.5 * s * testing::random_direction(random);
        Matrix3 R = testing::random_rotation(random).toRotationMatrix();
        PairSeed seed;
        for (int k = 0; k < 40; ++k) {
          const RigidPose X_WB(R, X_WA.translation() + p_AB);
          if (k % 10 == 0)
            seed = seed_at(internal_box_pivot(*a, X_WA, *b, X_WB), *a, X_WA, *b, X_WB);
          check(*a, X_WA, *b, X_WB, seed, s);
          p_AB = 0.97 * p_AB + testing::random_vector(0.02 * s, random);
          R = rotation_from_vector(testing::random_vector(0.1, random)) * R;
        }
      }
    }
  }
}

TEST(PivotSeed, LeavesTheDistanceAsItIs) {
  walk_pairs([](const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                PairSeed& seed, Scalar s) {
    const DistanceResult cold = distance(a, X_WA, b, X_WB);
    const DistanceResult warm = seeded_distance(a, X_WA, b, X_WB, {}, seed);
    const Scalar noise = 1e-9 * s;
    EXPECT_LE(warm.lower, cold.upper);
    EXPECT_GE(warm.upper, cold.lower);
    EXPECT_NEAR(warm.upper, cold.upper, noise);
    EXPECT_NEAR(warm.lower, cold.lower, noise);
    EXPECT_EQ(warm.status, cold.status);
  });
}

TEST(PivotSeed, StopsWhereTheLimitIsProven) {
  int farther = 0;
  walk_pairs([&](const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                 PairSeed& seed, Scalar s) {
    const DistanceResult cold = distance(a, X_WA, b, X_WB);
    DistanceOptions options;
    options.max_distance = 0.3 * s;
    const DistanceResult warm = seeded_distance(a, X_WA, b, X_WB, options, seed);
    EXPECT_LE(warm.lower, cold.upper);
    EXPECT_GE(warm.upper, cold.lower);
    if (warm.status == DistanceStatus::FartherThanMaxDistance) {
      ++farther;
      EXPECT_GT(warm.lower, options.max_distance);
    } else {
      EXPECT_NEAR(warm.upper, cold.upper, 1e-9 * s);
    }
  });
  EXPECT_GT(farther, 500);
}

TEST(PivotSeed, EveryQueryThatTouchesHasAUnitNormal) {
  int touching = 0;
  const MeshArrays cube = box_mesh({0.9, 0.5, 0.02});
  auto all = walked_shapes(1);
  all.push_back(std::make_shared<TriangleMesh>(cube.mesh()));
  for (const auto& a : all) {
    for (const auto& b : all) {
      PairSeed seed;
      // From face to face to the same middle, and back; each twice.
      for (const Scalar x : {1.9, 1.8, 1.8, 1.0, 1.0, 0.0, 0.0, 1.0, 1.8, 0.0}) {
        const RigidPose X_WA(Vector3(0.1, 0.2, 0.3));
        const RigidPose X_WB(Vector3(0.1 + x, 0.2, 0.3));
        clear_stack();
        const DistanceResult warm =
            seeded_distance(*a, X_WA, *b, X_WB, {.max_distance = 0.05}, seed);
        const DistanceResult cold = distance(*a, X_WA, *b, X_WB);
        ASSERT_NEAR(warm.nhat_AB_W.norm(), 1, 8 * kUnitRoundoff) << x;
        ASSERT_NEAR(cold.nhat_AB_W.norm(), 1, 8 * kUnitRoundoff) << x;
        touching += cold.status == DistanceStatus::Overlapping;
      }
    }
  }
  EXPECT_GT(touching, 200);
}

TEST(PivotSeed, LiesInTheMiddleBetweenFacingSides) {
  const Box a(Vector3(1, 1, 1));
  const Box b(Vector3(0.5, 2, 1));
  const Pivot pivot = internal_box_pivot(a, RigidPose(), b, RigidPose(Vector3(4, 1, 0)));
  // x between 1 and 3.5; y where both are, -1 to 1; z where both are, -1 to 1.
  EXPECT_TRUE(pivot.p_W.isApprox(Vector3(2.25, 0, 0)));
  EXPECT_TRUE(pivot.nhat_AB_W.isApprox(Vector3(4, 1, 0).normalized()));
}

TEST(PivotSeed, SavesWork) {
  std::int64_t cold = 0;
  std::int64_t warm = 0;
  walk_pairs([&](const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                 PairSeed& seed, Scalar) {
    const auto work = [](const DistanceStatistics& s) {
      return s.box_tests + 5 * s.leaf_tests + s.gjk_iterations;
    };
    cold += work(distance(a, X_WA, b, X_WB).statistics);
    warm += work(seeded_distance(a, X_WA, b, X_WB, {}, seed).statistics);
  });
  EXPECT_LT(warm, cold);
}

}  // namespace
}  // namespace dyop::distance_internal
