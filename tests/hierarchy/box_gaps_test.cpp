// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/box_gaps.h"

#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "geometry/shape_tree.h"
#include "support/oracles/box_oracle.h"

namespace dyop::hierarchy_internal {
namespace {

using geometry_internal::facing_box;
using geometry_internal::rows_of;
using testing::Corners;
using testing::corners_of;
using testing::random_box;
using testing::surface_distance;

constexpr int kWidth = BoxGroup::kWidth;

std::vector<InstructionSet> runnable_sets() {
  std::vector<InstructionSet> sets{InstructionSet::Baseline};
  const InstructionSet best = best_instruction_set();
  if (best != InstructionSet::Baseline) sets.push_back(InstructionSet::Avx2);
  if (best == InstructionSet::Avx512) sets.push_back(InstructionSet::Avx512);
  return sets;
}

std::array<Scalar, kWidth> gaps_of(const BoxGroup& group, const BoxFrame& frame,
                                   const FacingBox& other, Scalar noise,
                                   InstructionSet set = best_instruction_set()) {
  std::array<Scalar, kWidth> gaps;
  box_gaps_kernel(set)(rows_of(group, frame), kWidth, other, noise, gaps.data());
  return gaps;
}

struct RandomCase {
  BoxGroup group;
  BoxFrame frame;
  OrientedBox other;
  RigidPose X_SO;
  Scalar noise;
};

// Every other group is up to 1e7 times its size from the origin.
RandomCase random_case(std::mt19937_64& random) {
  RandomCase result;
  const Scalar size = testing::random_magnitude(-4, 4, random);
  OrientedBox all;
  all.half_extents = Vector3::Constant(4 * size);
  const bool is_far = testing::random_index(2, random) == 0;
  if (is_far) {
    all.center = testing::random_vector(size, random) * testing::random_magnitude(0, 7, random);
  }
  result.frame = BoxFrame::around(all);
  for (int k = 0; k < kWidth; ++k) {
    OrientedBox box = random_box(size, random);
    box.center += all.center;
    result.group.set_box(k, box, result.frame);
  }
  result.other = random_box(size, random);
  const RigidPose near = testing::random_pose(4 * size, random);
  result.X_SO = RigidPose(near.rotation(), near.translation() + all.center);
  result.noise = kStepNoise * (result.X_SO.translation().norm() + all.center.norm() + 16 * size);
  return result;
}

// Cubes of half width 1 with centers 5 apart along x: the faces are 3 apart. Turned by 45 degrees
// about z the other shows an edge at 5 - sqrt(2). Boxes are stored in single precision.
TEST(BoxGaps, MeasureFacesAndEdges) {
  OrientedBox cube;
  cube.half_extents = Vector3(1, 1, 1);
  const BoxFrame frame{.scale = 8};
  BoxGroup group;
  for (int k = 0; k < kWidth; ++k) group.set_box(k, cube, frame);
  const Matrix3 R = Eigen::AngleAxisd(std::acos(-1) / 4, Vector3::UnitZ()).toRotationMatrix();
  for (const InstructionSet set : runnable_sets()) {
    const auto faces =
        gaps_of(group, frame, facing_box(cube, RigidPose(Vector3(5, 0.5, 0))), 0, set);
    const auto edges =
        gaps_of(group, frame, facing_box(cube, RigidPose(R, Vector3(5, 0, 0))), 0, set);
    for (int k = 0; k < kWidth; ++k) {
      EXPECT_NEAR(faces[std::size_t(k)], 3, 3e-6);
      EXPECT_NEAR(edges[std::size_t(k)], 4 - std::sqrt(2), 3e-6);
    }
  }
}

TEST(BoxGaps, AreNotPositiveForBoxesThatOverlap) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 1000; ++k) {
    RandomCase c = random_case(random);
    // A corner of the other in a point of box 0.
    const OrientedBox box = c.group.box(0, c.frame);
    const Vector3 x = testing::random_vector(1, random);
    const Vector3 p = box.center + box.axes * box.half_extents.cwiseProduct(x);
    c.other.center = p - c.other.axes * c.other.half_extents;
    ASSERT_LE(gaps_of(c.group, c.frame, facing_box(c.other, RigidPose()), c.noise)[0], 0) << k;
  }
}

TEST(BoxGaps, AreNeverAboveTheDistanceOfTheBoxesAndMostlyNear) {
  std::mt19937_64 random(4);
  int separated = 0;
  int near = 0;
  for (int k = 0; k < 100; ++k) {
    const RandomCase c = random_case(random);
    const auto gaps = gaps_of(c.group, c.frame, facing_box(c.other, c.X_SO), c.noise);
    for (int column = 0; column < kWidth; ++column) {
      const Scalar gap = gaps[std::size_t(column)];
      if (gap <= 0) continue;
      ++separated;
      const Scalar distance = surface_distance(
          corners_of(c.group.box(column, c.frame), RigidPose()), corners_of(c.other, c.X_SO));
      ASSERT_LE(gap, distance + c.noise) << k;
      near += gap >= 0.9 * distance;
    }
  }
  EXPECT_GT(separated, 300);
  EXPECT_GT(near, 0.8 * separated);
}

// Edges turned by about 1e-3 against each other, seen crosswise: the length of their cross product
// must not lose digits.
TEST(BoxGaps, AreNotAboveTheDistanceOfNearlyParallelEdges) {
  std::mt19937_64 random(6);
  OrientedBox needle;
  needle.half_extents = Vector3(0, 0, 1);
  const BoxFrame frame{.scale = 4};
  BoxGroup group;
  for (int k = 0; k < kWidth; ++k) group.set_box(k, needle, frame);
  for (int k = 0; k < 300; ++k) {
    const Scalar angle = testing::random_number(1e-3, 3e-3, random);
    const Matrix3 R = (Eigen::AngleAxisd(testing::random_number(0, 6, random), Vector3::UnitZ()) *
                       Eigen::AngleAxisd(angle, Vector3::UnitX()))
                          .toRotationMatrix();
    const Vector3 axis = Vector3::UnitZ().cross(R.col(2)).normalized();
    const RigidPose X_SO(R, axis + testing::random_number(-0.5, 0.5, random) * Vector3::UnitZ());
    const Scalar gap = gaps_of(group, frame, facing_box(needle, X_SO), kStepNoise * 4)[0];
    ASSERT_LE(gap, surface_distance(corners_of(group.box(0, frame), RigidPose()),
                                    corners_of(needle, X_SO)) +
                       kStepNoise * 4);
  }
}

TEST(BoxGaps, HaveTheSameBitsOnEveryInstructionSet) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 20000; ++k) {
    const RandomCase c = random_case(random);
    const FacingBox other = facing_box(c.other, c.X_SO);
    const auto expected = gaps_of(c.group, c.frame, other, c.noise, InstructionSet::Baseline);
    for (const InstructionSet set : runnable_sets()) {
      ASSERT_EQ(gaps_of(c.group, c.frame, other, c.noise, set), expected) << k;
    }
  }
}

}  // namespace
}  // namespace dyop::hierarchy_internal
