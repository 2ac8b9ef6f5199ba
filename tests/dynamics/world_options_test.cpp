// SPDX-License-Identifier: BSD-3-Clause

// Structs that users fill in can be written with the members that matter, without a warning, and
// the others have their defaults.
#include "dyop/dynamics/world_options.h"

#include <gtest/gtest.h>

#include "dyop/dynamics/world.h"
#include "dyop/geometry/primitives.h"
#include "dyop/toi/obstacle_set.h"

#pragma GCC diagnostic error "-Wmissing-field-initializers"

namespace dyop {
namespace {

TEST(WorldOptions, AreWrittenByTheMembersThatMatter) {
  const Vector3 down(0, 0, -9.81);
  World world(WorldOptions{.gravity_W = down, .max_step = 0.01});
  EXPECT_EQ(world.gravity(), down);
  EXPECT_EQ(world.options().sleep_steps, WorldOptions().sleep_steps);
  EXPECT_FALSE(world.options().target_distance.has_value());
  const auto ball = std::make_shared<Sphere>(0.5);
  const BodyId post = world.add_body({.name = "post", .kind = BodyKind::Static, .shape = ball});
  const BodyId body = world.add_body({.name = "ball",
                                      .shape = ball,
                                      .initial = {.X_WB = RigidPose(Vector3(2, 0, 0))},
                                      .mass_properties = ball->compute_mass_properties(1)});
  const JointId hinge =
      world.add_joint({.kind = JointKind::Hinge, .a = post, .b = body, .friction = 1e-3});
  world.set_motor(hinge, JointMotor{.speed = 1, .strength = 2});
  world.add_spring({.a = post, .b = body, .stiffness = 1});
  EXPECT_EQ(world.joint(hinge).break_force, kInfinity);
  EXPECT_EQ(world.body(body).filter, CollisionFilter());
  EXPECT_EQ(world.advance(0.01, AdvanceLimits{.max_steps = 1}).status, AdvanceStatus::Completed);
}

TEST(WorldOptions, SoAreQueries) {
  const Sphere ball(0.5);
  World world;
  const BodyFilter only{.mask = 4};
  EXPECT_EQ(world.cast_ray({0, 0, 0}, {1, 0, 0}, 1, only).status, ToiStatus::Separated);
  const ToiOptions options{.target_distance = 0.1};
  EXPECT_FALSE(options.deadline.has_value());
  const DistanceQuery query{.a = &ball, .b = &ball};
  EXPECT_EQ(query.options.max_distance, kInfinity);
  const Obstacle obstacle{.shape = std::make_shared<Sphere>(1), .groups = 2};
  EXPECT_EQ(obstacle.X_WO, nullptr);
}

}  // namespace
}  // namespace dyop
