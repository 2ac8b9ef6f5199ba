// SPDX-License-Identifier: BSD-3-Clause

// Bodies some of whose axes are locked, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "support/inputs/world_scenes.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kRollerTorque = 100;

// A bead on a wire: of gravity only the part along the wire counts.
TEST(LockedAxes, ABeadFallsAlongItsWire) {
  WorldOptions options;
  options.gravity_W = Vector3(3, -4, -8);
  World world(options);
  BodyDefinition bead = dynamic_body("bead", std::make_shared<Sphere>(0.1), {1, 2, 3});
  bead.locked.translation = {false, true, true};
  const BodyId id = world.add_body(bead);
  run_for(world, 1);
  EXPECT_NEAR(world.state(id).X_WB.translation().x(), 1 + 1.5, 1e-9);
  EXPECT_NEAR(world.state(id).twist.v_WB.x(), 3, 1e-9);
  EXPECT_EQ(world.state(id).X_WB.translation().y(), 2);
  EXPECT_EQ(world.state(id).X_WB.translation().z(), 3);
}

// With friction 1 a free block so tall would tip over.
TEST(LockedAxes, ATallBlockThatMustNotTipSlidesAsFarAsFrictionLets) {
  constexpr Scalar kSpeed = 2;
  World world(earth_options());
  world.add_body(floor_body(1));
  const auto shape = std::make_shared<Box>(Vector3(0.1, 0.1, 0.8));
  BodyDefinition block = dynamic_body(
      "block", shape, {0, 0, 0.8 + rest_gap(shape->bounding_radius())}, {kSpeed, 0, 0});
  block.locked.rotation = {true, true, true};
  block.friction = 1;
  block.restitution = 0;
  const BodyId id = world.add_body(block);
  run_for(world, 1);
  const Scalar way = kSpeed * kSpeed / (2 * kGravity);
  EXPECT_NEAR(world.state(id).X_WB.translation().x(), way, 1e-3 * way);
  EXPECT_EQ(world.state(id).X_WB.rotation(), Matrix3::Identity());
  EXPECT_TRUE(world.is_asleep(id));
}

// A roller that turns in place drives a plank that lies on it and on a smooth support: friction
// accelerates the plank by what bears on the roller until the roller's rim has its speed.
TEST(LockedAxes, ARollerThatCannotMoveDrivesABlock) {
  constexpr Scalar kFriction = 0.4;
  World world;
  BodyDefinition roller = dynamic_body("roller", std::make_shared<Sphere>(0.5), {0, 0, 0});
  roller.locked.translation = {true, true, true};
  roller.locked.rotation = {true, false, true};
  roller.friction = kFriction;
  roller.restitution = 0;
  roller.wrench = [](Scalar, const MotionState&) {
    return Wrench{Vector3::Zero(), Vector3(0, kRollerTorque, 0)};
  };
  const BodyId roller_id = world.add_body(roller);
  const auto shape = std::make_shared<Box>(Vector3(0.4, 0.4, 0.1));
  BodyDefinition block = dynamic_body("block", shape, {0, 0, 0.6 + rest_gap(0.5)});
  block.locked.translation = {false, true, false};
  block.locked.rotation = {true, true, true};
  block.friction = kFriction;
  block.restitution = 0;
  const Scalar weight = block.mass_properties.mass * kGravity;
  block.wrench = [weight](Scalar, const MotionState&) {
    return Wrench{{0, 0, -weight}, Vector3::Zero()};
  };
  const BodyId block_id = world.add_body(block);
  run_for(world, 0.5);
  // It sticks: T = (I / r + m r) a.
  const Scalar inertia = roller.mass_properties.I_BBcm(1, 1);
  const Scalar a = kRollerTorque / (inertia / 0.5 + block.mass_properties.mass * 0.5);
  EXPECT_NEAR(world.state(block_id).twist.v_WB.x(), a * 0.5, 2e-3 * a);
  EXPECT_NEAR(world.state(roller_id).twist.w_WB.y(), a, 4e-3 * a);
  EXPECT_EQ(world.state(roller_id).X_WB.translation().norm(), 0);
}

}  // namespace
}  // namespace dyop
