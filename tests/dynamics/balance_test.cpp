// SPDX-License-Identifier: BSD-3-Clause

// The static certificate: what is balanced sleeps at once, what is not stays awake, however slow.
#include <gtest/gtest.h>

#include <cmath>

#include "support/inputs/curved_meshes.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kStep = 0.01;

// Steps until a body falls asleep; `most` if none does.
int steps_awake(World& world, int most) {
  for (int k = 1; k <= most; ++k) {
    const AdvanceReport report = world.advance(kStep);
    EXPECT_EQ(report.status, AdvanceStatus::Completed);
    if (!report.fell_asleep.empty()) return k;
  }
  return most;
}

// A cube on a slope of this tangent, with coefficient 0.5.
int steps_awake_on_slope(Scalar tangent) {
  WorldOptions options;
  const Scalar angle = std::atan(tangent);
  options.gravity_W = kGravity * Vector3(std::sin(angle), 0, -std::cos(angle));
  World world(options);
  world.add_body(floor_body(0.5));
  world.add_body(resting_cube(0, 0, 0));
  return steps_awake(world, 100);
}

TEST(Balance, PutsWhatStandsToSleepAtOnce) {
  World stack(earth_options());
  add_columns(stack, 1, 10);
  EXPECT_LT(steps_awake(stack, 100), 20);
  World pyramid(earth_options());
  add_pyramid(pyramid, 5);
  EXPECT_LT(steps_awake(pyramid, 100), 20);
  EXPECT_LT(steps_awake_on_slope(0), 20);
  EXPECT_LT(steps_awake_on_slope(0.49), 20);
  EXPECT_LT(steps_awake_on_slope(0.4999), 20);
}

TEST(Balance, LeavesAwakeWhatSlides) {
  EXPECT_EQ(steps_awake_on_slope(0.5005), 100);  // 1.001 of its friction
  // By then it has been slow for 50 steps.
  EXPECT_GE(steps_awake_on_slope(0.50005), 50);
}

// Bricks on each other, each shifted by `shift`: they topple if the middle of those above a brick
// is beyond its edge.
TEST(Balance, LeavesAwakeAStackThatLeansTooFar) {
  for (const Scalar shift : {0.24, 0.26}) {
    World world(earth_options());
    world.add_body(floor_body(0.5));
    Scalar z = 0;
    for (int k = 0; k < 4; ++k) {
      const BodyDefinition cube = resting_cube(shift * k, 0, z);
      z = cube.initial.X_WB.translation().z() + 0.5;
      world.add_body(cube);
    }
    // The lowest of the three upper ones is at its edge at a shift of 1/4.
    const int steps = steps_awake(world, 30);
    EXPECT_EQ(steps < 30, shift < 0.25) << shift;
    for (int k = 0; k < 200; ++k) world.advance(kStep);
    const Scalar lowest = world.state(world.bodies().back()).X_WB.translation().z();
    EXPECT_EQ(lowest<z - 1, shift> 0.25) << shift;
  }
}

// At the turning points of its rocking a half disc is slow, and its weight is not above its
// contact.
TEST(Balance, LeavesAwakeWhatTurnsBack) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const auto mesh = std::make_shared<TriangleMesh>(half_disc(0.5, 0.25, 128).mesh());
  BodyDefinition body = dynamic_body("half disc", mesh, {0, 0, 0.5 + rest_gap(0.6)});
  body.initial.X_WB =
      RigidPose(rotation_from_vector(Vector3(0, 0.3, 0)), body.initial.X_WB.translation());
  body.restitution = 0;
  world.add_body(body);
  EXPECT_EQ(steps_awake(world, 150), 150);
}

// A ball lies still on a level floor, and begins to roll on one that is not level by a ten
// thousandth.
TEST(Balance, LeavesAwakeABallOnASlope) {
  for (const bool is_slope : {false, true}) {
    WorldOptions options;
    options.gravity_W = kGravity * Vector3(is_slope ? 1e-4 : 0, 0, -1);
    World world(options);
    world.add_body(floor_body(0.5));
    BodyDefinition ball =
        dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, 0.5 + rest_gap(0.5)});
    ball.restitution = 0;
    world.add_body(ball);
    EXPECT_EQ(steps_awake(world, 40) < 40, !is_slope);
  }
}

}  // namespace
}  // namespace dyop
