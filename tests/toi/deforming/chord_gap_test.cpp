// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "toi/deforming/standing_pair.h"

namespace dyop {
namespace {

// The gap along n is sampled while both move.
TEST(ChordGap, IsBelowTheGapAtAllTimesAndExactAtRest) {
  std::mt19937_64 random(11);
  const auto arrays = testing::plate_grid(4, 4, 3, 3);
  const TriangleMesh ball = testing::icosphere(1).mesh();
  for (int k = 0; k < 300; ++k) {
    std::vector<Vector3> end = arrays.vertices;
    for (Vector3& p : end) p += testing::random_vector(0.3, random);
    const DeformingMesh sheet(arrays.vertices, end, arrays.triangles);
    const Scalar motion_size = k % 10 == 0 ? 0 : 1;
    const DeformingSpan span{0.25, motion_size > 0 ? 0.75 : 0.25};
    const ConstantTwistMotion motion(
        RigidPose(testing::random_rotation(random), testing::random_vector(3, random)),
        {motion_size * testing::random_vector(2, random),
         motion_size * testing::random_vector(1, random)});
    const Scalar duration = 0.5;
    const toi_internal::ChordGap chord(sheet, span, ball, motion, duration);
    const Vector3 n_W = testing::random_direction(random);
    const auto i = testing::random_index(int(arrays.triangles.size()), random);
    const auto j = testing::random_index(int(ball.triangles().size()), random);
    Scalar least = kInfinity;
    constexpr int kSamples = 64;
    for (int step = 0; step <= kSamples; ++step) {
      const Scalar part = Scalar(step) / kSamples;
      const Triangle a = sheet.triangle(i, span.begin + part * (span.end - span.begin));
      const RigidPose X_WB = motion.pose(part * duration);
      for (const Vector3& p : a) {
        for (const Vector3& q_B : ball.triangle(j))
          least = std::min(least, n_W.dot(X_WB * q_B - p));
      }
    }
    const Scalar bound = chord.least(i, j, n_W);
    EXPECT_LE(bound, least) << k;
    // A point at r from the origin leaves its chord by at most T^2 w^2 r / 8.
    const Scalar turn = duration * motion.twist(0).w_WB.norm();
    EXPECT_GE(bound, least - turn * turn / 8 * 1.01 - 1e-9) << k;  // literal: rounding
  }
}

TEST(ChordGap, OfBoxesIsBelowThatOfTheirTriangles) {
  std::mt19937_64 random(12);
  const auto arrays = testing::plate_grid(4, 4, 3, 3);
  const TriangleMesh ball = testing::icosphere(1).mesh();
  for (int k = 0; k < 100; ++k) {
    std::vector<Vector3> end = arrays.vertices;
    for (Vector3& p : end) p += testing::random_vector(0.3, random);
    const DeformingMesh sheet(arrays.vertices, end, arrays.triangles);
    const DeformingSpan span{0.25, 0.75};
    const ConstantTwistMotion motion(
        RigidPose(testing::random_rotation(random), testing::random_vector(3, random)),
        {testing::random_vector(2, random), testing::random_vector(1, random)});
    const Scalar duration = 0.5;
    const toi_internal::ChordGap chord(sheet, span, ball, motion, duration);
    const toi_internal::StandingPair first(sheet, span.begin, ball, motion.pose(0));
    const toi_internal::StandingPair last(sheet, span.end, ball, motion.pose(duration));
    const Vector3 n_W = testing::random_direction(random);
    const Scalar bound = chord.least_of_boxes(first, last, 0, 0, n_W);
    constexpr int kSamples = 32;
    Scalar least = kInfinity;
    for (int step = 0; step <= kSamples; ++step) {
      const Scalar part = Scalar(step) / kSamples;
      const TriangleMesh now = sheet.snapshot(span.begin + part * (span.end - span.begin));
      const RigidPose X_WB = motion.pose(part * duration);
      for (const Vector3& p : now.vertices()) {
        for (const Vector3& q_B : ball.vertices()) least = std::min(least, n_W.dot(X_WB * q_B - p));
      }
    }
    EXPECT_LE(bound, least) << k;
    // Boxes are larger, but not by more than their diagonals.
    EXPECT_GE(bound, least - 4) << k;
  }
}

}  // namespace
}  // namespace dyop
