// SPDX-License-Identifier: BSD-3-Clause
#include "distance/gjk/warm_gjk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/clear_stack.h"
#include "support/inputs/random_inputs.h"

namespace dyop::distance_internal {
namespace {

std::vector<std::unique_ptr<ConvexShape>> shapes_of_size(Scalar s) {
  std::vector<std::unique_ptr<ConvexShape>> result;
  result.push_back(std::make_unique<Box>(s * Vector3(0.9, 0.5, 0.02)));
  result.push_back(std::make_unique<Capsule>(0.1 * s, 0.8 * s));
  result.push_back(std::make_unique<Sphere>(0.5 * s));
  std::mt19937_64 random(6);
  std::vector<Vector3> points(32);
  for (Vector3& p : points) p = s * testing::random_vector(0.7, random);
  result.push_back(std::make_unique<ConvexHull>(points));
  return result;
}

Scalar size_of(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  return X_AB.translation().norm() + a.bounding_radius() + b.bounding_radius();
}

// The slab gap along the result's normal; below zero by as much as the shapes overlap there.
Scalar slab_gap(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                const Vector3& nhat_A) {
  const Vector3 n_B = X_AB.rotation().transpose() * nhat_A;
  return nhat_A.dot(X_AB * b.support(-n_B) - a.support(nhat_A));
}

// Calls check(a, b, X_AB, seed) for a walk of small random steps of every pair of shapes.
template <typename Check>
void walk(const Check& check) {
  std::mt19937_64 random(11);
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    const auto all = shapes_of_size(s);
    for (const auto& a : all) {
      for (const auto& b : all) {
        GjkSeed seed;
        Vector3 p_AB = 2 * s * testing::random_direction(random);
        Matrix3 R_AB = testing::random_rotation(random).toRotationMatrix();
        for (int k = 0; k < 60; ++k) {
          check(*a, *b, RigidPose(R_AB, p_AB), seed);
          p_AB *= 0.98;
          p_AB += s * testing::random_vector(0.02, random);
          R_AB = rotation_from_vector(testing::random_vector(0.1, random)) * R_AB;
        }
      }
    }
  }
}

TEST(WarmGjk, GivesTheDistanceOfAColdQuery) {
  int warm_iterations = 0;
  int cold_iterations = 0;
  walk([&](const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB, GjkSeed& seed) {
    const GjkResult warm = gjk_distance(a, b, X_AB, GjkGoal{}, seed);
    const GjkResult cold = dyop::gjk_distance(a, b, X_AB);
    // Both converge to noise on polytopes and to kGjkSmoothConvergence on smooth cores.
    const Scalar noise =
        4 * kPoseNoise * size_of(a, b, X_AB) + 2 * kGjkSmoothConvergence * cold.upper;
    EXPECT_LE(warm.lower, cold.upper);
    EXPECT_GE(warm.upper, cold.lower);
    EXPECT_NEAR(warm.lower, cold.lower, noise);
    EXPECT_NEAR(warm.upper, cold.upper, noise);
    EXPECT_EQ(warm.is_overlapping, cold.is_overlapping);
    EXPECT_NEAR(warm.nhat_AB.norm(), 1, 4 * kUnitRoundoff);
    warm_iterations += warm.iterations;
    cold_iterations += cold.iterations;
  });
  EXPECT_LT(warm_iterations, 0.7 * cold_iterations);
}

TEST(WarmGjk, StopsEarlyWithBoundsThatHoldAndKeepTheGoal) {
  int early = 0;
  walk([&](const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB, GjkSeed& seed) {
    const GjkGoal goal{.apart = 0.01 * a.bounding_radius(), .share = 0.25};
    const GjkResult rough = gjk_distance(a, b, X_AB, goal, seed);
    const GjkResult exact = dyop::gjk_distance(a, b, X_AB);
    EXPECT_LE(rough.lower, exact.upper);
    EXPECT_GE(rough.upper, exact.lower);
    // The slab gap along the normal that is handed out proves the bound.
    if (rough.lower > 0) {
      EXPECT_GE(slab_gap(a, b, X_AB, rough.nhat_AB), rough.lower);
    }
    if (exact.lower > 2 * goal.apart) {
      EXPECT_GT(rough.lower, goal.apart);
      EXPECT_LE(rough.upper - rough.lower, 0.26 * (rough.lower - goal.apart));
    }
    early += rough.upper - rough.lower > 1e-6 * rough.upper && rough.lower > 0;
  });
  EXPECT_GT(early, 300);
}

TEST(WarmGjk, SaysOnWhichSideOfTheGoalADistanceIs) {
  int hits = 0;
  walk([&](const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB, GjkSeed& seed) {
    const Scalar limit = 0.1 * a.bounding_radius();
    const GjkGoal goal{.apart = limit, .share = kInfinity, .hit = limit};
    const GjkResult result = gjk_distance(a, b, X_AB, goal, seed);
    const GjkResult exact = dyop::gjk_distance(a, b, X_AB);
    if (exact.lower > 1.001 * limit) {
      EXPECT_GT(result.lower, limit);
    }
    if (exact.upper < 0.999 * limit) {
      EXPECT_LT(result.upper, limit);
      ++hits;
    }
  });
  EXPECT_GT(hits, 300);
}

TEST(WarmGjk, OfShapesThatTouchHasAUnitNormal) {
  const GjkGoal goal{.apart = 0, .share = kInfinity};
  int touching = 0;
  for (const Scalar s : {1e-4, 1.0, 1e4}) {
    const auto all = shapes_of_size(s);
    const Box cube(s * Vector3(1, 1, 1));
    std::vector<const ConvexShape*> pointers{&cube};
    for (const auto& shape : all) pointers.push_back(shape.get());
    for (const ConvexShape* a : pointers) {
      for (const ConvexShape* b : pointers) {
        GjkSeed seed;
        // Apart, face to face, deep, the same centre; each again with its own seed, then back.
        for (const Scalar x : {2.5, 2.0, 2.0, 1.9, 1.0, 1.0, 0.0, 0.0, 1e-9, 1.0, 2.0, 0.0, 2.5}) {
          const RigidPose X_AB(s * x * Vector3::UnitX());
          testing::clear_stack();
          const GjkResult result = gjk_distance(*a, *b, X_AB, goal, seed);
          ASSERT_NEAR(result.nhat_AB.norm(), 1, 4 * kUnitRoundoff) << s << ' ' << x;
          EXPECT_LE(slab_gap(*a, *b, X_AB, result.nhat_AB), result.upper);
          touching += result.is_overlapping;
        }
      }
    }
  }
  EXPECT_GT(touching, 400);
}

TEST(WarmGjk, WithASeedThatTouchesIsAColdQuery) {
  const Box box(Vector3(1, 1, 1));
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 p_touching = 2 * Vector3::Unit(axis) + 0.3 * Vector3::Unit((axis + 1) % 3);
    const RigidPose X_apart(Vector3(p_touching + 0.1 * Vector3::Unit(axis)));
    const RigidPose X_touching(p_touching);
    GjkSeed seed;
    gjk_distance(box, box, X_apart, GjkGoal{}, seed);
    testing::clear_stack();
    const GjkResult warm = gjk_distance(box, box, X_touching, GjkGoal{}, seed);
    const GjkResult cold = dyop::gjk_distance(box, box, X_touching);
    EXPECT_TRUE(warm.is_overlapping);
    EXPECT_EQ(warm.nhat_AB, cold.nhat_AB) << axis;
    EXPECT_EQ(warm.iterations, cold.iterations);
  }
}

TEST(WarmGjk, TakesAnySeedThatHasPointsOfTheShapes) {
  // A seed from somewhere else altogether, twice the same point among it.
  const Box box(Vector3(1, 1, 1));
  GjkSeed seed;
  seed.count = 3;
  seed.a = {box.core_support({-1, 1, 1}), box.core_support({-1, 1, 1}),
            box.core_support({-1, 1, -1})};
  seed.b = seed.a;
  const GjkResult result =
      gjk_distance(box, box, RigidPose(Vector3(3.5, 0.25, 0)), GjkGoal{}, seed);
  EXPECT_NEAR(result.lower, 1.5, 1e-13);
  EXPECT_NEAR(result.upper, 1.5, 1e-13);
  EXPECT_NEAR((result.nhat_AB - Vector3::UnitX()).norm(), 0, 1e-13);
}

}  // namespace
}  // namespace dyop::distance_internal
