// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/swept_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "geometry/all_compounds.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"
#include "toi/obstacles/obstacle_tree.h"

namespace dyop::toi_internal {
namespace {

// At every time of a part the shape's box at its pose lies in the swept box.
TEST(SweptBoxes, HoldTheShapeAllTheTime) {
  testing::Random random(3);
  for (const testing::MotionMaker& maker : testing::kAllMotions) {
    for (const Scalar size : {1e-4, 1.0, 1e4}) {
      const testing::Scales scales{2 * size, 3 * size, 4, {-1, 2}};
      const auto motion = maker.make(random, scales);
      const TriangleMesh mesh = testing::gear(6, 0.8, 1, 0.2)
                                    .moved(Matrix3::Identity(), size * Vector3(0.2, 0.1, 0), size)
                                    .mesh();
      const TimeParts parts{scales.span, 7};
      const SweptBoxes swept(mesh, *motion, parts);
      for (int i = 0; i < parts.count; ++i) {
        const TimeInterval part = parts.part(i);
        for (int k = 0; k <= 20; ++k) {
          const Scalar t = std::min(part.begin + part.length() * k / 20, part.end);
          const RigidPose X = motion->pose(t);
          for (const Vector3& p : mesh.vertices()) {
            EXPECT_TRUE(swept.part(i).contains(X * p)) << maker.name << " " << t;
          }
        }
        EXPECT_TRUE(swept.whole().contains(swept.part(i)));
      }
      EXPECT_EQ(parts.time(0), -1);
      EXPECT_EQ(parts.time(7), 2);
    }
  }
}

TEST(SweptBoxes, SayWhichPartsComeNear) {
  const testing::MeshArrays box = testing::box_mesh(Vector3(0.5, 0.5, 0.5));
  const ConstantTwistMotion motion = testing::moving(testing::at(0, 0, 0), {8, 0, 0});
  const SweptBoxes swept(box.mesh(), motion, {{0, 1}, 8});
  const AlignedBox target(Vector3(3.6, -1, -1), Vector3(4.4, 1, 1));
  // Reached when the front passes 3.6, left when the back passes 4.4: t in [3.1, 4.9] / 8.
  EXPECT_EQ(swept.first_near(target, 0, 0), 3);
  EXPECT_EQ(swept.last_near(target, 0, 3), 4);
  EXPECT_EQ(swept.first_near(target, 1.2, 0), 1);
  EXPECT_EQ(swept.first_near(target, 0, 5), std::nullopt);
  EXPECT_EQ(swept.least_gap(target), 0);
  const AlignedBox aside(Vector3(3.6, 1.5, -1), Vector3(4.4, 2, 1));
  EXPECT_EQ(swept.first_near(aside, 0.9, 0), std::nullopt);
  EXPECT_NEAR(swept.least_gap(aside), 1, 1e-9);
  EXPECT_LE(swept.least_gap(aside), 1);
}

TEST(ObstacleTree, HoldsEveryItemOnceInItsBoxes) {
  testing::Random random(9);
  for (const int count : {1, 2, 3, 17, 200}) {
    std::vector<ObstacleTree::Item> items;
    for (int i = 0; i < count; ++i) {
      const Vector3 center = i % 5 == 0 ? Vector3::Zero() : random.in_ball(10);
      items.push_back({AlignedBox(center, center + Vector3(1, 2, 3)), std::uint32_t(i)});
    }
    const ObstacleTree tree(items);
    EXPECT_EQ(tree.item_count(), std::size_t(count));
    std::set<std::uint32_t> seen;
    for (const ObstacleTree::Node& node : tree.nodes()) {
      if (node.is_leaf()) {
        seen.insert(node.number());
        EXPECT_TRUE(node.box.isApprox(items[node.number()].box));
      } else {
        EXPECT_TRUE(node.box.contains(tree.nodes()[node.child()].box));
        EXPECT_TRUE(node.box.contains(tree.nodes()[node.child() + 1].box));
      }
    }
    EXPECT_EQ(seen.size(), std::size_t(count));
  }
  EXPECT_TRUE(ObstacleTree().nodes().empty());
}

}  // namespace
}  // namespace dyop::toi_internal
