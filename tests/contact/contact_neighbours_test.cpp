// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "contact/generation/contact_search.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;

// The same bits as without a list, in front of an edge, a corner and a round surface.
TEST(ContactNeighbours, GiveTheContactsThatTheTreesDo) {
  std::mt19937_64 random(4);
  const std::vector<std::shared_ptr<const Shape>> tools{
      std::make_shared<Sphere>(0.3), std::make_shared<Capsule>(0.1, 0.3),
      std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)),
      std::make_shared<ConvexHull>(
          std::vector<Vector3>{{0.3, 0, 0}, {-0.3, 0, 0}, {0, 0.4, 0}, {0, 0, 0.2}}),
      std::make_shared<TriangleMesh>(torus(0.3, 0.1, 16, 10).mesh())};
  const std::vector<std::shared_ptr<const Shape>> grounds{
      std::make_shared<TriangleMesh>(icosphere(3).mesh()),
      std::make_shared<TriangleMesh>(box_mesh({1, 0.7, 0.5}).mesh()),
      std::make_shared<TriangleMesh>(plate_grid(2, 2, 12, 12).mesh())};
  ContactWorkspace workspace;
  int covered = 0, contacts = 0;
  for (const auto& tool : tools) {
    for (const auto& ground : grounds) {
      for (int k = 0; k < 40; ++k) {
        const bool is_swapped = k % 2 != 0;
        const Shape& a = is_swapped ? *ground : *tool;
        const Shape& b = is_swapped ? *tool : *ground;
        RigidPose X_WA = random_pose(1, random);
        RigidPose X_WB(
            random_rotation(random).toRotationMatrix(),
            X_WA.translation() + random_number(0.9, 1.2, random) * random_direction(random));
        distance_internal::NeighbourList list;
        const Vector3 pivot = (X_WA.translation() + X_WB.translation()) / 2;
        if (!list.build(a, X_WA, b, X_WB, pivot, {0.3, 0.2})) continue;
        X_WB = RigidPose(rotation_from_vector(random_vector(0.02, random)) * X_WB.rotation(),
                         X_WB.translation() + random_vector(0.02, random));
        const Scalar reach = 0.2;
        if (!list.covers(list.place(a, X_WA, b, X_WB), {reach})) continue;
        ++covered;
        std::vector<ContactPoint> by_tree, by_list;
        generate_contacts(a, X_WA, b, X_WB, reach, {}, workspace, by_tree);
        {
          const contact_internal::ScopedUse use(workspace.impl().neighbours, list);
          generate_contacts(a, X_WA, b, X_WB, reach, {}, workspace, by_list);
        }
        ASSERT_EQ(by_tree.size(), by_list.size());
        contacts += int(by_tree.size());
        for (std::size_t i = 0; i < by_tree.size(); ++i) {
          EXPECT_EQ(by_tree[i].key, by_list[i].key);
          EXPECT_EQ(by_tree[i].gap, by_list[i].gap);
          EXPECT_EQ(by_tree[i].p_WCa, by_list[i].p_WCa);
          EXPECT_EQ(by_tree[i].nhat_AB_W, by_list[i].nhat_AB_W);
        }
      }
    }
  }
  EXPECT_GT(covered, 100);
  EXPECT_GT(contacts, 200);
}

}  // namespace
}  // namespace dyop
