// SPDX-License-Identifier: BSD-3-Clause
#include "toi/obstacles/swept_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

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

// The boxes hold what is below them, parents and children agree, and no leaf is deeper than
// allowed.
void expect_sound(const ObstacleTree& tree, const std::map<std::uint32_t, AlignedBox>& items,
                  int most_depth) {
  EXPECT_EQ(tree.item_count(), items.size());
  std::set<std::uint32_t> seen;
  std::vector<std::pair<std::int32_t, int>> open;
  if (tree.root() != ObstacleTree::kNone) open.push_back({tree.root(), 0});
  while (!open.empty()) {
    const auto [number, depth] = open.back();
    open.pop_back();
    const ObstacleTree::Node& node = tree.node(number);
    EXPECT_LE(depth, most_depth);
    if (node.is_leaf()) {
      EXPECT_TRUE(seen.insert(node.number).second);
      EXPECT_TRUE(node.box.isApprox(items.at(node.number)));
      continue;
    }
    for (const std::int32_t child : node.children) {
      EXPECT_EQ(tree.node(child).parent, number);
      EXPECT_TRUE(node.box.contains(tree.node(child).box));
      open.push_back({child, depth + 1});
    }
  }
  EXPECT_EQ(seen.size(), items.size());
}

AlignedBox box_at(const Vector3& center) {
  return AlignedBox(center, center + Vector3(1, 2, 3));
}

TEST(ObstacleTree, HoldsEveryItemOnceInItsBoxes) {
  testing::Random random(9);
  for (const int count : {0, 1, 2, 3, 17, 200, 1000}) {
    ObstacleTree tree;
    std::map<std::uint32_t, AlignedBox> items;
    for (int i = 0; i < count; ++i) {
      const std::uint32_t number = std::uint32_t(i);
      items[number] = box_at(i % 5 == 0 ? Vector3(Vector3::Zero()) : random.in_ball(10));
      tree.insert(items[number], number);
    }
    expect_sound(tree, items, count);
  }
}

// In a row, as a wall is built: every new item is beyond all others.
TEST(ObstacleTree, StaysShallowWhateverTheOrder) {
  ObstacleTree tree;
  std::map<std::uint32_t, AlignedBox> items;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    items[i] = box_at(Vector3(2 * Scalar(i), 0, 0));
    tree.insert(items[i], i);
  }
  expect_sound(tree, items, 40);
}

TEST(ObstacleTree, ItemsComeMoveAndGo) {
  testing::Random random(10);
  ObstacleTree tree;
  std::map<std::uint32_t, AlignedBox> items;
  std::map<std::uint32_t, std::int32_t> leaves;
  for (std::uint32_t i = 0; i < 6000; ++i) {
    const std::uint32_t number = (i * 7919) % 500;
    if (items.count(number) != 0) {
      tree.remove(leaves.at(number));
      items.erase(number);
      if (i % 3 == 0) continue;
    }
    items[number] = box_at(random.in_ball(20));
    leaves[number] = tree.insert(items[number], number);
    if (i % 500 == 0) expect_sound(tree, items, 40);
  }
  expect_sound(tree, items, 40);
  for (const auto& [number, box] : items) tree.remove(leaves.at(number));
  expect_sound(tree, {}, 0);
}

}  // namespace
}  // namespace dyop::toi_internal
