// SPDX-License-Identifier: BSD-3-Clause

// The record of a near pair after every step, its dynamic pivot above all.
#include <gtest/gtest.h>

#include <algorithm>

#include "dyop/distance/distance.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

// A ball that falls on a floor: far, then in contact.
TEST(WorldPivot, LiesBetweenTheBoxesAndThenBetweenWitnesses) {
  World world(earth_options());
  const BodyId floor = world.add_body(floor_body(0.5));
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0.3, -0.2, 0.62});
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  bool was_far = false;
  bool was_near = false;
  for (int k = 0; k < 60; ++k) {
    ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
    const auto pairs = world.pairs();
    if (pairs.empty()) continue;
    ASSERT_EQ(pairs.size(), 1U);
    const PairRecord& pair = pairs.front();
    EXPECT_EQ(pair.a, floor);
    EXPECT_EQ(pair.b, id);
    const Vector3 p = world.state(id).X_WB.translation();
    // In both phases the middle between the floor's top and the ball's lowest point.
    EXPECT_NEAR(pair.pivot_W.z(), (p.z() - 0.5) / 2, 1e-12);
    EXPECT_NEAR(pair.pivot_W.x(), p.x(), 1e-12);
    EXPECT_NEAR(pair.pivot_W.y(), p.y(), 1e-12);
    EXPECT_LE(pair.gap_lower, p.z() - 0.5);
    (pair.contacts.empty() ? was_far : was_near) = true;
    if (pair.contacts.empty()) continue;
    EXPECT_NEAR(pair.nhat_AB_W.z(), 1, 1e-12);
    EXPECT_GE(pair.gap_upper, p.z() - 0.5 - 1e-12);
  }
  EXPECT_TRUE(was_far);
  EXPECT_TRUE(was_near);
}

TEST(WorldPivot, RecordsWhatAContactCarries) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  for (int k = 0; k < 20; ++k) world.advance(0.01);
  const auto contacts = world.contacts();
  ASSERT_EQ(contacts.size(), 1U);
  ASSERT_EQ(contacts.front().contacts.size(), 4U);
  Vector3 impulse = Vector3::Zero();
  for (const PairContact& contact : contacts.front().contacts) impulse += contact.impulse_W;
  const Scalar weight = kGravity * world.body(cube).mass_properties.mass;
  EXPECT_NEAR(impulse.z(), 0.01 * weight, 1e-6 * weight);
  EXPECT_LT(impulse.head<2>().norm(), 1e-6 * weight);
  EXPECT_LT(contacts.front().residual, 1e-6);
}

// Bodies that no query has been asked about have one picked by the pivot; the trajectory is the
// same to rounding whether meshes or boxes meet.
TEST(WorldPivot, SeedsQueriesOfMeshes) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const auto mesh = std::make_shared<TriangleMesh>(torus(0.5, 0.2, 32, 16).mesh());
  BodyDefinition ring = dynamic_body("ring", mesh, {0, 0, 0.5}, Vector3::Zero(), {0.3, 0.2, 1});
  ring.restitution = 0;
  const BodyId a = world.add_body(ring);
  ring.initial.X_WB = RigidPose(Vector3(0.1, 0, 1.1));
  const BodyId b = world.add_body(ring);
  for (int k = 0; k < 100; ++k) {
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_TRUE(report.too_near.empty());
    const DistanceResult d = distance(*mesh, world.state(a).X_WB, *mesh, world.state(b).X_WB);
    for (const PairRecord& pair : world.pairs()) {
      if (pair.a != a || pair.b != b) continue;
      EXPECT_LE(pair.gap_lower, d.upper);
      EXPECT_GE(pair.gap_upper, d.lower - 1e-12);
    }
  }
}

}  // namespace
}  // namespace dyop
