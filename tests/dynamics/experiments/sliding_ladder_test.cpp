// SPDX-License-Identifier: BSD-3-Clause

// A ladder that slides down a wall and along a floor without friction. From the energy, its
// centre's horizontal speed grows until the ladder is at two thirds of its first height; there it
// leaves the wall and keeps that speed.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

TEST(SlidingLadder, LeavesTheWallAtTwoThirdsOfItsHeight) {
  for (const Scalar h : {0.02, 0.005}) {
    for (const Scalar turn : {0.0, 0.7}) {  // of the whole scene about the vertical
      constexpr Scalar kRadius = 0.01;
      constexpr Scalar kLength = 1;  // between the centres of the rounded ends
      const Scalar first = 75 * std::numbers::pi / 180;
      World world(earth_options());
      world.add_body(floor_body(0));
      const Matrix3 R = rotation_from_vector(Vector3(0, 0, turn));
      BodyDefinition wall = floor_body(0);
      wall.shape = std::make_shared<Box>(Vector3(1, 20, 20));
      wall.initial.X_WB = RigidPose(R, R * Vector3(-1, 0, 20.01));
      world.add_body(wall);
      const auto shape = std::make_shared<Capsule>(kRadius, kLength / 2);
      const Scalar inset = kRadius + rest_gap(shape->bounding_radius());
      BodyDefinition ladder = dynamic_body("ladder", shape, Vector3::Zero());
      const Vector3 center(inset + kLength / 2 * std::cos(first), 0,
                           inset + kLength / 2 * std::sin(first));
      const Matrix3 lean = rotation_from_vector(Vector3(0, first - std::numbers::pi / 2, 0));
      ladder.initial.X_WB = RigidPose(R * lean, R * center);
      ladder.friction = 0;
      ladder.restitution = 0;
      const BodyId id = world.add_body(ladder);
      while (world.state(id).X_WB.rotation()(2, 2) > 0.3) {
        ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
        ASSERT_LT(world.time(), 2);
      }
      const MassProperties& m = ladder.mass_properties;
      const Scalar inertia = m.I_BBcm(0, 0) + m.mass * kLength * kLength / 4;
      const Scalar turning =
          std::sqrt(m.mass * kGravity * kLength * std::sin(first) / (3 * inertia));
      const Scalar expected = turning * kLength / 3 * std::sin(first);
      EXPECT_NEAR(world.state(id).twist.v_WB.dot(R.col(0)), expected, 1e-3 * expected) << h;
      EXPECT_NEAR(world.state(id).twist.v_WB.dot(R.col(1)), 0, 1e-3 * expected) << h;
    }
  }
}

}  // namespace
}  // namespace dyop
