// SPDX-License-Identifier: BSD-3-Clause

// Pairs that become candidates within a step, because an impact or a wake-up gave a body another
// motion than was expected of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kRadius = 0.1;
constexpr Scalar kTouching = 2 * kRadius + 1e-4;  // centres of balls within each other's reach
constexpr Scalar kArrivalStep = 0.01;

BodyDefinition elastic_ball(const std::string& name, const Vector3& p,
                            const Vector3& v = Vector3::Zero()) {
  BodyDefinition ball = dynamic_body(name, std::make_shared<Sphere>(kRadius), p, v);
  ball.restitution = 1;
  ball.friction = 0;
  return ball;
}

// A thin plate across the x axis.
BodyDefinition wall_at(Scalar x) {
  BodyDefinition wall = floor_body(0, 1);
  wall.name = "wall";
  wall.shape = std::make_shared<Box>(Vector3(0.01, 1, 1));
  wall.initial.X_WB = RigidPose(Vector3(x, 0, 0));
  return wall;
}

TEST(WorldNewPairs, OfAnIslandThatIsKeptAreProvenWhileOthersMeet) {
  World world{WorldOptions{}};
  const BodyId thrower = world.add_body(elastic_ball("thrower", {-kTouching, 0, 0}, {30, 0, 0}));
  const BodyId thrown = world.add_body(elastic_ball("thrown", {0, 0, 0}));
  // Belongs to the same island by its spring; the thrown ball passes it closely, without a hit.
  const BodyId passed = world.add_body(elastic_ball("passed", {0.45, 0.15, 0}));
  SpringDefinition spring;
  spring.name = "spring";
  spring.a = thrower;
  spring.b = passed;
  spring.stiffness = 1;
  world.add_spring(spring);
  // Elsewhere a ball at rest is hit and hits another one, which nothing foretold: islands are
  // planned again.
  const BodyId left = world.add_body(elastic_ball("left", {0, 10, 0}, {20, 0, 0}));
  world.add_body(elastic_ball("middle", {0.25, 10, 0}));
  const BodyId right = world.add_body(elastic_ball("right", {0.5, 10, 0}));
  const AdvanceReport report = world.advance(kArrivalStep);
  EXPECT_EQ(report.work.discarded_runs, 2);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_GT(world.state(thrown).X_WB.translation().x(), 0.25);
  EXPECT_LT(world.state(left).twist.v_WB.x(), 1);
  EXPECT_GT(world.state(right).twist.v_WB.x(), 19);
}

// Two balls that are about to meet are stepped together from the start: nothing is thrown away.
TEST(WorldNewPairs, ThatWillMeetAreForetold) {
  World world{WorldOptions{}};
  const BodyId left = world.add_body(elastic_ball("left", {0, 0, 0}, {20, 0, 0}));
  world.add_body(elastic_ball("right", {0.5, 0, 0}, {-20, 0, 0}));
  const AdvanceReport report = world.advance(kArrivalStep);
  EXPECT_EQ(report.impacts.size(), 1u);
  EXPECT_LT(world.state(left).twist.v_WB.x(), -19);
  EXPECT_EQ(report.work.islands, 1);
  EXPECT_EQ(report.work.discarded_runs, 0);
}

TEST(WorldNewPairs, OfABodyThatWokeInThisStepAreFound) {
  WorldOptions options = earth_options();
  options.sleep_steps = 3;
  World world(options);
  world.add_body(floor_body(0));
  const Scalar lying = kRadius + rest_gap(kRadius);
  const BodyId sleeper = world.add_body(elastic_ball("sleeper", {0, 0, lying}));
  constexpr Scalar kWall = 0.4;
  world.add_body(wall_at(kWall));
  const BodyId ball = world.add_body(elastic_ball("ball", {-8, 0, lying}));
  for (int k = 0; k < 100 && !world.is_asleep(sleeper); ++k) world.advance(kArrivalStep);
  ASSERT_TRUE(world.is_asleep(sleeper));
  MotionState state = world.state(ball);
  state.X_WB = RigidPose(Vector3(-kTouching, 0, lying));
  state.twist.v_WB = Vector3(60, 0, 0);
  world.set_state(ball, state);
  world.advance(kArrivalStep);
  EXPECT_FALSE(world.is_asleep(sleeper));
  EXPECT_LT(world.state(sleeper).X_WB.translation().x(), kWall - kRadius);
}

// A ball that passes a large island by a hundredth of its radius may meet it once contacts change
// velocities: it runs with it from the start, instead of both again later. One that rests there
// does not.
TEST(WorldNewPairs, OfALargeIslandAreForeseenWhereSomethingPassesIt) {
  for (const Scalar speed : {0.0, 2.0}) {
    World world{WorldOptions{}};
    constexpr int kRow = 20;
    SpringDefinition spring;
    spring.name = "spring";
    spring.stiffness = 1;
    for (int k = 0; k < kRow; ++k) {
      const BodyId ball = world.add_body(elastic_ball("ball", {0.5 * k, 0, 0}));
      spring.a = spring.b;
      spring.b = ball;
      if (k > 0) world.add_spring(spring);
    }
    world.add_body(elastic_ball("passing", {-0.01, 2.01 * kRadius, 0}, {speed, 0, 0}));
    const AdvanceReport report = world.advance(kArrivalStep);
    EXPECT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_EQ(report.work.islands, speed > 0 ? 1 : 2);
  }
}

// Balls that are poured between walls: once most of them touch, the island that they form is
// hardly ever stepped in vain, and nothing is left unsolved.
TEST(WorldNewPairs, OfACrowdThatIsPouredAreForeseen) {
  WorldOptions options = earth_options();
  options.sleep_steps = 0;
  World world(options);
  world.add_body(floor_body(0.5));
  for (const Scalar sign : {-1.0, 1.0}) world.add_body(wall_at(0.46 * sign));
  std::minstd_rand random(3);
  for (int i = 0; i < 64; ++i) {
    const Scalar jitter = 0.02 * Scalar(random()) / Scalar(std::minstd_rand::max());
    const Vector3 place(i % 4, i / 4 % 4, i / 16);
    BodyDefinition ball =
        elastic_ball("ball", 0.22 * place + Vector3(jitter - 0.33, -jitter, 0.12));
    ball.restitution = 0;
    ball.friction = 0.5;
    world.add_body(ball);
  }
  StepStatistics work;
  for (int k = 0; k < 50; ++k) {
    const AdvanceReport report = world.advance(kArrivalStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    work.contacts = std::max(work.contacts, report.work.contacts);
    work.unconverged += report.work.unconverged;
    work.stalls += report.work.stalls;
    if (report.work.contacts <= 60) continue;
    work.discarded_runs += report.work.discarded_runs;
    work.rounds += report.work.rounds;
  }
  EXPECT_GT(work.contacts, 60);
  EXPECT_LE(work.discarded_runs, 2);
  EXPECT_LE(work.rounds, 2);
  EXPECT_EQ(work.unconverged, 0);
  EXPECT_EQ(work.stalls, 0);
}

}  // namespace
}  // namespace dyop
