// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/deforming_sides.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::toi_internal {
namespace {

// The bound of deforming_sides.h, without the part that is the search's: rounding.
template <typename Support>
Scalar bound_after(const Support& support, const MotionRemainder& rest, Scalar u) {
  return support.at(u, u * u / 2) + rest.jerk * u * u * u / 6 + rest.acceleration * u * u / 2;
}

Scalar largest_along_W(const Triangle& triangle, const RigidPose& X_WB, const Vector3& n_W) {
  Scalar largest = -kInfinity;
  for (const Vector3& p : triangle) largest = std::max(largest, n_W.dot(X_WB * p));
  return largest;
}

TEST(DeformingSides, BoundATurningTriangleAndItsBoxAtAllLaterTimes) {
  std::mt19937_64 random(1);
  const TriangleMesh mesh = testing::icosphere(0).mesh();
  const TimeInterval interval{1, 2};
  Scalar slack = 0;  // how much of the bound is not used; small if the bound is of second order
  int count = 0;
  for (int i = 0; i < 400; ++i) {
    const RigidPose begin(testing::random_rotation(random), testing::random_vector(2, random));
    const RigidPose end(testing::random_rotation(random), testing::random_vector(2, random));
    const Twist twist{testing::random_vector(2, random), testing::random_vector(6, random)};
    std::unique_ptr<Motion> motion = std::make_unique<ConstantTwistMotion>(begin, twist);
    if (i % 2 == 1) {
      motion = std::make_unique<HermiteMotion>(interval, MotionState{begin, twist},
                                               MotionState{end, twist});
    }
    RigidSide side(mesh, *motion, interval);
    const Scalar t = testing::random_number(1, 1.9, random);
    side.set_time(t);
    side.set_horizon(t, 2);
    std::int32_t leaf = 0;
    while (!side.is_leaf(leaf))
      leaf = side.part(leaf, testing::random_index(side.part_count(leaf), random));
    const Vector3 n_W = testing::random_direction(random);
    const Triangle triangle = mesh.triangle(side.triangle(leaf));
    const auto triangle_support = side.triangle_support(leaf, n_W);
    const auto box_support = side.box_support(leaf, n_W);
    const MotionRemainder rest = side.rest(leaf, triangle_support);
    EXPECT_NEAR(triangle_support.at(0, 0), largest_along_W(triangle, side.pose(), n_W), 1e-12);
    for (int k = 1; k <= 20; ++k) {
      const Scalar u = (2 - t) * k / 20;
      const Scalar truth = largest_along_W(triangle, motion->pose(t + u), n_W);
      ASSERT_GE(bound_after(triangle_support, rest, u), truth - 1e-12) << i << " after " << u;
      ASSERT_GE(bound_after(box_support, rest, u), truth - 1e-12) << i << " after " << u;
    }
    if (i % 2 == 0) {
      const Scalar u = 0.01;
      slack += bound_after(triangle_support, rest, u) -
               largest_along_W(triangle, motion->pose(t + u), n_W);
      ++count;
    }
  }
  // Constant twists: the bound is off by the third order only, w^3 u^3 / 3 of about 6^3 1e-6 / 3.
  EXPECT_LT(slack / count, 1e-4);
}

TEST(DeformingSides, BoundADeformingTriangleAndItsBoxExactly) {
  std::mt19937_64 random(2);
  const testing::MeshArrays arrays = testing::icosphere(1);
  std::vector<Vector3> moved = arrays.vertices;
  for (Vector3& p : moved) p += testing::random_vector(1, random);
  const DeformingMesh mesh(arrays.vertices, moved, arrays.triangles);
  const TimeInterval interval{-3, 5};
  DeformingSide side(mesh, interval);
  for (int i = 0; i < 300; ++i) {
    const Scalar t = testing::random_number(-3, 5, random);
    side.set_time(t);
    const Vector3 n_W = testing::random_direction(random);
    std::int32_t node = 0;
    for (int depth = testing::random_index(5, random); depth > 0 && !side.is_leaf(node); --depth) {
      node = side.part(node, testing::random_index(2, random));
    }
    std::int32_t leaf = node;
    while (!side.is_leaf(leaf))
      leaf = side.part(leaf, testing::random_index(side.part_count(leaf), random));
    const auto box_support = side.box_support(node, n_W);
    const auto triangle_support = side.triangle_support(leaf, n_W);
    for (int k = 0; k <= 10; ++k) {
      const Scalar u = (5 - t) * k / 10;
      const Triangle later = mesh.triangle(side.triangle(leaf), (t + u + 3) / 8);
      const Scalar truth = largest_along_W(later, RigidPose(), n_W);
      ASSERT_NEAR(triangle_support.at(u, u * u / 2), truth, 1e-12);
      ASSERT_GE(box_support.at(u, u * u / 2), truth - 1e-12);
    }
  }
}

TEST(DeformingSides, TakeTheVelocityOfTheWitnessPoint) {
  // Corner 0 rises at speed 3 over two units of time, the others rest.
  const DeformingMesh mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 6}, {1, 0, 0}, {0, 1, 0}},
                           {{0, 1, 2}});
  DeformingSide side(mesh, {0, 2});
  side.set_time(0);
  EXPECT_NEAR((side.velocity_at(0, {0, 0, 0}) - Vector3(0, 0, 3)).norm(), 0, 1e-15);
  EXPECT_NEAR((side.velocity_at(0, {0.5, 0, 0}) - Vector3(0, 0, 1.5)).norm(), 0, 1e-15);
  EXPECT_NEAR((side.velocity_at(0, {0.25, 0.25, 0}) - Vector3(0, 0, 1.5)).norm(), 0, 1e-15);
}

}  // namespace
}  // namespace dyop::toi_internal
