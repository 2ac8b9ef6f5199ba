// SPDX-License-Identifier: BSD-3-Clause

// A palm whose poses come one at a time, with two jaws on sliders that motors of a known force
// close on a cube, lifts it. The cube slips while the lift starts and stops at once, by what
// friction says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

void add_jaw(World& world, BodyId palm, Scalar side, Scalar force) {
  BodyDefinition jaw =
      dynamic_body("jaw", std::make_shared<Box>(Vector3(0.02, 0.08, 0.2)), {side * 0.2, 0, 0.3});
  jaw.friction = 0.5;
  jaw.restitution = 0;
  const BodyId id = world.add_body(jaw);
  JointDefinition slider;
  slider.name = "slider" + std::to_string(side);
  slider.kind = JointKind::Slider;
  slider.a = palm;
  slider.b = id;
  const Matrix3 R = rotation_from_vector(Vector3(0, -side * std::numbers::pi / 2, 0));
  slider.X_AJ = RigidPose(R, Vector3(side * 0.2, 0, -0.3));
  slider.X_BJ = RigidPose(R, Vector3::Zero());
  slider.motor = JointMotor{.speed = 0.2, .strength = force};
  world.add_joint(slider);
}

// The cube lies on the floor between the open jaws, whose motors begin to close.
struct Gripper {
  explicit Gripper(Scalar safety) {
    world.add_body(floor_body(0.5));
    const auto shape = std::make_shared<Box>(Vector3(0.1, 0.1, 0.1));
    height = 0.1 + rest_gap(shape->bounding_radius());
    BodyDefinition cube = dynamic_body("cube", shape, {0, 0, height});
    cube.friction = 0.5;
    cube.restitution = 0;
    held = world.add_body(cube);
    BodyDefinition palm = floor_body(0.5);
    palm.name = "palm";
    palm.kind = BodyKind::Kinematic;
    palm.shape = std::make_shared<Box>(Vector3(0.3, 0.1, 0.02));
    palm.motion = std::make_shared<RestMotion>(RigidPose(Vector3(0, 0, 0.6)));
    palm.initial.X_WB = palm.motion->pose(0);
    hand = world.add_body(palm);
    const Scalar force = safety * cube.mass_properties.mass * kGravity / (2 * 0.5);
    add_jaw(world, hand, 1, force);
    add_jaw(world, hand, -1, force);
  }
  RigidPose X_HandHeld() const { return world.state(hand).X_WB.inverse() * world.state(held).X_WB; }

  World world{earth_options()};
  BodyId hand, held;
  Scalar height = 0;
};

// In some steps all the load had drifted to one edge of the cube, which turned and slipped by 20
// times as much.
TEST(Gripper, HoldsWhatItsFrictionCanHold) {
  constexpr Scalar kLift = 0.3;  // speed, for one unit of time
  for (const Scalar h : {0.01, 0.005, 0.0025}) {
    for (const Scalar safety : {1.2, 1.5, 2.0}) {
      Gripper gripper(safety);
      World& world = gripper.world;
      for (int k = 1; k <= std::lround(3 / h); ++k) {
        const Scalar t = k * h;
        if (t > 1 + h / 2 && t < 2 + h / 2) {
          world.set_next_pose(gripper.hand, RigidPose(Vector3(0, 0, 0.6 + kLift * (t - 1))), t);
        }
        ASSERT_EQ(world.advance(t - world.time()).status, AdvanceStatus::Completed);
      }
      const Scalar slip = kLift * kLift / (2 * kGravity * (safety - 1));
      const Scalar rise = kLift * kLift / (2 * kGravity * (safety + 1));
      const RigidPose X_WB = world.state(gripper.held).X_WB;
      EXPECT_NEAR(X_WB.translation().z(), gripper.height + kLift - slip + rise, 1e-3)
          << h << ' ' << safety;
      EXPECT_GT(X_WB.rotation().trace(), 3 - 1e-3) << h << ' ' << safety;
    }
  }
}

// A quarter turn about the axis across the jaws. Where edges of cube and jaw cross friction had
// counted the velocity at the start of each step, so that the cube crept outwards, by 3 mm at h =
// 0.01.
TEST(Gripper, HoldsWhileItTurns) {
  for (const Scalar h : {0.01, 0.0025}) {
    Gripper gripper(3);
    World& world = gripper.world;
    const auto smooth = [](Scalar t) {
      return (1 - std::cos(std::numbers::pi * std::clamp(t, 0.0, 1.0))) / 2;
    };
    RigidPose X_HandHeld;
    for (int k = 1; k <= std::lround(3.2 / h); ++k) {
      const Scalar t = k * h;
      const Vector3 turn(smooth(t - 2) * std::numbers::pi / 2, 0, 0);
      const Vector3 p(0, 0, 0.6 + 0.5 * smooth(t - 1));
      world.set_next_pose(gripper.hand, RigidPose(rotation_from_vector(turn), p), t);
      ASSERT_EQ(world.advance(t - world.time()).status, AdvanceStatus::Completed);
      if (k == std::lround(2 / h)) X_HandHeld = gripper.X_HandHeld();
    }
    const RigidPose change = X_HandHeld.inverse() * gripper.X_HandHeld();
    EXPECT_LT(change.translation().norm(), 1e-4) << h;
    EXPECT_GT(change.rotation().trace(), 3 - 1e-6) << h;
  }
}

// Jaws without joints, which forces press together: bodies that can move along x alone. No impulse
// tells how the load is shared here either.
TEST(Gripper, HoldsBetweenJawsThatForcesPress) {
  const std::shared_ptr<const Shape> shapes[] = {std::make_shared<Box>(Vector3(0.1, 0.1, 0.1)),
                                                 std::make_shared<Box>(Vector3(0.1, 0.05, 0.15)),
                                                 std::make_shared<Sphere>(0.1)};
  const auto jaw = std::make_shared<Box>(Vector3(0.02, 0.12, 0.12));
  for (const auto& shape : shapes) {
    for (const Scalar safety : {1.2, 2.0}) {
      World world(earth_options());
      BodyDefinition held = dynamic_body("held", shape, Vector3::Zero());
      held.friction = 0.5;
      held.restitution = 0;
      const BodyId id = world.add_body(held);
      const Scalar force = safety * held.mass_properties.mass * kGravity / (2 * 0.5);
      for (const int side : {-1, 1}) {
        BodyDefinition body = dynamic_body("jaw", jaw, Vector3(side * 0.1205, 0, 0));
        body.friction = 0.5;
        body.restitution = 0;
        body.locked = {{false, true, true}, {true, true, true}};
        body.wrench = [side, force](Scalar, const MotionState&) {
          return Wrench{Vector3(-side * force, 0, 0), Vector3::Zero()};
        };
        world.add_body(body);
      }
      for (int k = 0; k < 200; ++k) {
        ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
      }
      EXPECT_LE(world.state(id).X_WB.translation().norm(), 1e-3) << safety;
      EXPECT_GT(world.state(id).X_WB.rotation().trace(), 3 - 1e-6) << safety;
    }
  }
}

}  // namespace
}  // namespace dyop
