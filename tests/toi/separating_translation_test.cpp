// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/separating_translation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "dyop/core/error.h"
#include "dyop/distance/gjk.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/shape_oracle.h"

namespace dyop::testing {
namespace {

// The oracle: apart at the end, whatever the search did.
void expect_apart(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                  const Penetration& way) {
  EXPECT_NEAR(way.nhat_AB_W.norm(), 1, 1e-12);
  const RigidPose moved(X_WB.rotation(), X_WB.translation() + way.depth * way.nhat_AB_W);
  EXPECT_GT(oracle_distance(a, X_WA, b, moved).lower(), 0);
}

// Boxes as meshes: the least depth is known exactly for the same boxes as convex shapes.
TEST(SeparatingTranslation, OfBoxesIsNeverBelowTheLeastAndCloseToIt) {
  std::mt19937_64 random(6);
  int overlaps = 0;
  int long_ways = 0;
  for (int k = 0; k < 30; ++k) {
    const Scalar size = k % 3 == 0 ? 1e-3 : 1;
    const Vector3 half_a = size * Vector3(1, 0.6, 0.3);
    const Vector3 half_b = size * Vector3(0.4, 0.8, 0.5);
    const RigidPose X_WA(random_rotation(random), size * random_vector(0.5, random));
    const RigidPose X_WB(random_rotation(random), size * random_vector(0.5, random));
    const auto exact = find_penetration(Box(half_a), X_WA, Box(half_b), X_WB);
    const TriangleMesh a = box_mesh(half_a).mesh();
    const TriangleMesh b = box_mesh(half_b).mesh();
    const auto way = separating_translation(a, X_WA, b, X_WB);
    ASSERT_EQ(way.has_value(), exact.has_value());
    if (!way) continue;
    ++overlaps;
    expect_apart(a, X_WA, b, X_WB, *way);
    EXPECT_GE(way->depth, exact->depth * (1 - 1e-6));
    EXPECT_LE(way->depth, 1.3 * exact->depth);
    long_ways += way->depth > 1.02 * exact->depth;
  }
  EXPECT_GT(overlaps, 15);
  EXPECT_LE(long_ways, 3);
}

TEST(SeparatingTranslation, OfShapesThatAreApartIsNone) {
  const TriangleMesh ball = icosphere(2).mesh();
  EXPECT_FALSE(separating_translation(ball, RigidPose(), ball, RigidPose(Vector3(2.5, 0, 0))));
}

TEST(SeparatingTranslation, LeadsOutOfSolids) {
  // A small ball wholly inside a big one, whose surfaces do not meet.
  const TriangleMesh big = icosphere(3).mesh();
  const TriangleMesh small = icosphere(2, 0.1).mesh();
  const RigidPose X_WB(Vector3(0.5, 0, 0));
  const auto way = separating_translation(big, RigidPose(), small, X_WB);
  ASSERT_TRUE(way);
  EXPECT_NEAR(way->depth, 0.6, 0.01);
  EXPECT_NEAR(way->nhat_AB_W.x(), 1, 0.01);
  // A rod through the hole of a ring is not in it: the way out is sideways, into the hole.
  const TriangleMesh ring = torus(1, 0.3, 32, 16).mesh();
  const TriangleMesh rod = box_mesh({0.1, 0.1, 2}).mesh();
  const RigidPose X_WR(Vector3(0.65, 0, 0));
  const auto aside = separating_translation(ring, RigidPose(), rod, X_WR);
  ASSERT_TRUE(aside);
  expect_apart(ring, RigidPose(), rod, X_WR, *aside);
  EXPECT_LE(aside->depth, 0.8);
}

TEST(SeparatingTranslation, TakesEveryKindOfShape) {
  const auto ball = std::make_shared<Sphere>(1);
  const CompoundShape pair(
      {{ball, RigidPose(Vector3(1, 0, 0))}, {ball, RigidPose(Vector3(-1, 0, 0))}});
  const auto way = separating_translation(pair, RigidPose(), *ball, RigidPose(Vector3(0, 0.5, 0)));
  ASSERT_TRUE(way);
  // Between the two balls, up to where it touches both: sqrt(3) from the line of centres.
  EXPECT_GE(way->depth, std::sqrt(3.0) - 0.5 - 1e-5);
  EXPECT_LE(way->depth, std::sqrt(3.0) - 0.5 + 0.05);
}

TEST(SeparatingTranslation, RefusesOptions) {
  const Sphere ball(1);
  EXPECT_THROW(separating_translation(ball, RigidPose(), ball, RigidPose(), {.directions = 0}),
               InvalidArgument);
  EXPECT_THROW(separating_translation(ball, RigidPose(), ball, RigidPose(), {.tolerance = 0.0}),
               InvalidArgument);
}

}  // namespace
}  // namespace dyop::testing
