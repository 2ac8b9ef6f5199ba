// SPDX-License-Identifier: BSD-3-Clause

// Which approaches bounce by default: those faster than what forces change a speed by in two steps.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kBounceHeight = 1e-3;

BodyDefinition bouncing(std::shared_ptr<const Shape> shape, Scalar height, Scalar speed,
                        Scalar restitution) {
  const Scalar gap = rest_gap(shape->bounding_radius()) + kBounceHeight;
  BodyDefinition body =
      dynamic_body("bouncing", std::move(shape), {0, 0, height + gap}, {0, 0, -speed});
  body.restitution = restitution;
  return body;
}

// Falls kBounceHeight onto a floor, or up to a rest offset deeper, and bounces once.
void expect_bounce(const std::shared_ptr<const Shape>& shape, Scalar height, Scalar h) {
  constexpr Scalar kSpeed = 0.05;
  constexpr Scalar kRestitution = 0.8;
  World world(earth_options());
  world.add_body(floor_body(0.5, 1));
  const BodyId id = world.add_body(bouncing(shape, height, kSpeed, kRestitution));
  std::vector<ImpactEvent> impacts;
  while (world.time() < 0.015) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    impacts.insert(impacts.end(), report.impacts.begin(), report.impacts.end());
  }
  ASSERT_EQ(impacts.size(), 1u) << "h " << h;
  const Scalar met = -impacts[0].contacts.at(0).normal_velocity;
  const Scalar deepest = kBounceHeight + rest_gap(shape->bounding_radius());
  EXPECT_GE(met * met, kSpeed * kSpeed + 2 * kGravity * (1 - 1e-6) * kBounceHeight);
  EXPECT_LE(met * met, kSpeed * kSpeed + 2 * kGravity * deepest);
  EXPECT_NEAR(impacts[0].t, (met - kSpeed) / kGravity, 1e-9);
  const Scalar up = kRestitution * met - kGravity * (world.time() - impacts[0].t);
  EXPECT_NEAR(world.state(id).twist.v_WB.z(), up, 1e-6 * met) << "h " << h;
}

TEST(RestitutionSpeed, LetsABallAndABoxBounceInStepsOfAnyLength) {
  for (const Scalar h : {1e-3, 1e-4, 1e-5, 1e-6}) {
    expect_bounce(std::make_shared<Sphere>(0.5), 0.5, h);
    expect_bounce(std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)), 0.1, h);
  }
}

TEST(RestitutionSpeed, LetsSlowBallsBounceWhereNothingPullsThem) {
  for (const Scalar h : {1e-2, 1e-5}) {
    World world{WorldOptions{}};
    const auto shape = std::make_shared<Sphere>(0.5);
    std::vector<BodyId> balls;
    const Scalar speed = 1e-4;
    for (const Scalar x : {0.0, 1 + rest_gap(0.5) + h * speed / 2}) {
      BodyDefinition ball = dynamic_body("ball", shape, {x, 0, 0}, {x == 0 ? speed : 0, 0, 0});
      ball.restitution = 1;
      balls.push_back(world.add_body(ball));
    }
    for (int k = 0; k < 5; ++k) world.advance(h);
    EXPECT_NEAR(world.state(balls[0]).twist.v_WB.x() / speed, 0, 1e-2) << h;
    EXPECT_NEAR(world.state(balls[1]).twist.v_WB.x() / speed, 1, 1e-2) << h;
  }
}

// Pulled down by a force of its own, a ball bounces as often as by gravity.
TEST(RestitutionSpeed, CountsAForceOfABodyLikeGravity) {
  std::vector<std::size_t> impacts;
  for (const bool by_gravity : {true, false}) {
    World world(by_gravity ? earth_options() : WorldOptions{});
    world.add_body(floor_body(0.5, 1));
    BodyDefinition ball = bouncing(std::make_shared<Sphere>(0.5), 0.5, 2, 0.7);
    const Scalar weight = ball.mass_properties.mass * kGravity;
    if (!by_gravity) {
      ball.wrench = [weight](Scalar, const MotionState&) {
        return Wrench{{0, 0, -weight}, Vector3::Zero()};
      };
    }
    const BodyId id = world.add_body(ball);
    std::size_t count = 0;
    for (int k = 0; k < 200; ++k) count += world.advance(0.01).impacts.size();
    impacts.push_back(count);
    EXPECT_LT(world.state(id).twist.v_WB.norm(), 1e-6);
  }
  EXPECT_EQ(impacts[0], impacts[1]);
  EXPECT_GE(impacts[0], 5u);
}

// A ball that keeps a part e of its speed at each bounce lies still after a time that does not
// depend on the step: the sum of a geometric series. Its last bounces are lower than a landing is
// exact, and are left out.
void expect_rest(Scalar h, std::optional<Scalar> restitution_speed, Scalar restitution) {
  constexpr Scalar kDrop = 1;
  WorldOptions options = earth_options();
  options.restitution_speed = restitution_speed;
  World world(options);
  world.add_body(floor_body(0.5, 1));
  const auto shape = std::make_shared<Sphere>(0.5);
  BodyDefinition ball = dynamic_body("ball", shape, {0, 0, 0.5 + kDrop + rest_gap(0.5)});
  ball.restitution = restitution;
  const BodyId id = world.add_body(ball);
  const Scalar fall = std::sqrt(2 * kDrop / kGravity);
  const Scalar sum = fall * (1 + restitution) / (1 - restitution);
  const Scalar landing = rest_gap(0.5) / 5 * 4 * 0.3;  // the band in which a landing is found
  const Scalar lowest = std::sqrt(2 * kGravity * landing);
  const Scalar left_out = 2 * lowest / kGravity * restitution / (1 - restitution);
  std::size_t count = 0;
  Scalar last = 0;
  while (world.time() < sum + 60 * h) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    count += report.impacts.size();
    if (!report.impacts.empty()) last = report.impacts.back().t;
  }
  const Scalar bounces = std::log(lowest / (kGravity * fall)) / std::log(restitution);
  EXPECT_LE(last, sum + h) << h;
  EXPECT_GE(last, sum - left_out - 2 * h / (1 - restitution)) << h;
  EXPECT_LE(Scalar(count), bounces + 3) << h;
  EXPECT_TRUE(world.is_asleep(id)) << h;
}

TEST(RestitutionSpeed, OfAnySizeLetsABallComeToRestWhereItsBouncesEnd) {
  for (const Scalar h : {1e-3, 1e-2}) {
    for (const Scalar speed : {0.0, 1e-3, h * kGravity}) expect_rest(h, speed, 0.8);
  }
  expect_rest(1e-2, 0, 0.5);
  expect_rest(1e-2, 0, 0.95);
}

}  // namespace
}  // namespace dyop
