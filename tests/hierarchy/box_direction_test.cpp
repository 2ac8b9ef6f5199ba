// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "hierarchy/split_tree.h"
#include "support/inputs/random_inputs.h"

namespace dyop::hierarchy_internal {
namespace {

Scalar slab_gap(const OrientedBox& a, const OrientedBox& b, const Vector3& n) {
  const auto reach = [&](const OrientedBox& box) {
    Scalar sum = 0;
    for (int i = 0; i < 3; ++i) sum += std::abs(n.dot(box.axes.col(i))) * box.half_extents[i];
    return sum;
  };
  return n.dot(b.center - a.center) - reach(a) - reach(b);
}

OrientedBox random_box(const Vector3& center, bool is_turned, std::mt19937_64& random) {
  OrientedBox box;
  box.center = center;
  if (is_turned) box.axes = testing::random_rotation(random).toRotationMatrix();
  for (int i = 0; i < 3; ++i) box.half_extents[i] = testing::random_number(0, 1, random);
  return box;
}

TEST(BoxDirection, IsTheNearestWayBetweenAlignedBoxes) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 500; ++i) {
    const OrientedBox a = random_box(testing::random_vector(3, random), false, random);
    const OrientedBox b = random_box(testing::random_vector(3, random), false, random);
    Vector3 apart = Vector3::Zero();
    for (int k = 0; k < 3; ++k) {
      apart[k] = std::max(
          0.0, std::abs(b.center[k] - a.center[k]) - a.half_extents[k] - b.half_extents[k]);
    }
    const Vector3 n = separating_direction(a, b);
    EXPECT_NEAR(n.norm(), 1, 1e-14);
    if (!(apart.norm() > 0)) continue;
    EXPECT_NEAR(slab_gap(a, b, n), apart.norm(), 1e-12);
  }
}

TEST(BoxDirection, SeparatesTurnedBoxesWhereverADirectionDoes) {
  // By the separating axis theorem the axes suffice; random directions must not do what they do
  // not.
  std::mt19937_64 random(2);
  int separated = 0;
  for (int i = 0; i < 400; ++i) {
    const OrientedBox a = random_box(Vector3::Zero(), true, random);
    const OrientedBox b = random_box(testing::random_vector(2, random), true, random);
    const Scalar gap = slab_gap(a, b, separating_direction(a, b));
    separated += gap > 0 ? 1 : 0;
    for (int k = 0; k < 200 && gap <= 0; ++k) {
      EXPECT_LE(slab_gap(a, b, testing::random_direction(random)), 1e-9);
    }
  }
  EXPECT_GT(separated, 100);
  EXPECT_LT(separated, 350);
}

TEST(BoxDirection, IsAUnitVectorForBoxesInOnePlace) {
  EXPECT_NEAR(separating_direction(OrientedBox{}, OrientedBox{}).norm(), 1, 1e-15);
}

}  // namespace
}  // namespace dyop::hierarchy_internal
