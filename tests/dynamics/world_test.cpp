// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/world.h"

#include <gtest/gtest.h>

#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world_options.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::message_of;
using namespace testing;

BodyDefinition bouncing_ball(Scalar height, Scalar restitution) {
  BodyDefinition body = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, height + 0.5});
  body.restitution = restitution;
  return body;
}

TEST(World, FallsFreelyAsGalileoSays) {
  World world(earth_options());
  const BodyId ball = world.add_body(
      dynamic_body("ball", std::make_shared<Sphere>(0.5), {1, 2, 3}, {4, -1, 2}, {0, 0, 5}));
  const AdvanceReport report = world.advance(2);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_EQ(report.t, 2);
  const Vector3 expected = Vector3(1, 2, 3) + 2 * Vector3(4, -1, 2) + 2 * Vector3(0, 0, -kGravity);
  EXPECT_LT((world.state(ball).X_WB.translation() - expected).norm(), 1e-10);
  EXPECT_LT((world.state(ball).twist.w_WB - Vector3(0, 0, 5)).norm(), 1e-10);
  // The trajectory in between is the parabola, too.
  for (const CommittedStep& step : report.steps) {
    const Scalar t = step.interval.begin + 0.37 * step.interval.length();
    const Scalar z = 3 + 2 * t - kGravity * t * t / 2;
    EXPECT_NEAR(step.motions[0]->pose(t).translation().z(), z, 1e-10);
  }
}

TEST(World, FlipsAFreeTopAboutItsIntermediateAxisAndKeepsEnergyAndMomentum) {
  WorldOptions options;
  for (const IntegratorKind kind :
       {IntegratorKind::Arkode, IntegratorKind::CvodeAdams, IntegratorKind::CvodeBdf}) {
    options.integrator = kind;
    World world(options);
    const BodyId top = world.add_body(dynamic_body(
        "top", std::make_shared<Box>(Vector3(0.5, 0.3, 0.1)), {0, 0, 0}, {0, 0, 0}, {0.01, 6, 0}));
    const Scalar energy = world.kinetic_energy();
    const Vector3 momentum = world.angular_momentum();
    Scalar lowest = 1;
    std::int64_t steps = 0;
    for (int i = 0; i < 1000; ++i) {
      const AdvanceReport report = world.advance(0.01);
      ASSERT_EQ(report.status, AdvanceStatus::Completed);
      steps += report.integrator.steps;
      lowest = std::min(lowest, world.state(top).X_WB.rotation()(1, 1));
    }
    EXPECT_LT(lowest, -0.9);  // the y axis of the body turned over
    EXPECT_GT(steps, 0);
    EXPECT_NEAR(world.kinetic_energy() / energy, 1, 1e-5);
    EXPECT_LT((world.angular_momentum() - momentum).norm() / momentum.norm(), 1e-9);
  }
}

TEST(World, KeepsMomentumInFreeFlightAndAtImpactsToRounding) {
  World world;
  for (int i = 0; i < 20; ++i) {
    BodyDefinition body = dynamic_body("body", std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)),
                                       {1.5 * (i % 5), 1.5 * (i / 5), 0.01 * i},
                                       {i % 2 ? 1.0 : -0.5, 0.3 * (i % 3), 0.01},
                                       {0.3 * (i % 7), 1.0 + 0.1 * (i % 4), 0.2 * (i % 3)});
    body.restitution = 0.8;
    world.add_body(body);
  }
  const Vector3 momentum = world.momentum();
  const Vector3 spin = world.angular_momentum();
  std::size_t impacts = 0;
  for (int k = 0; k < 300; ++k) {
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    impacts += report.impacts.size();
  }
  EXPECT_GT(impacts, 0U);
  EXPECT_LT((world.momentum() - momentum).norm(), 1e-12 * momentum.norm());
  EXPECT_LT((world.angular_momentum() - spin).norm(), 1e-10 * spin.norm());
}

TEST(World, FollowsAWrenchLikeASpring) {
  // Without damping: x(t) = cos(t sqrt(k / m)).
  World world;
  BodyDefinition body = dynamic_body("mass", std::make_shared<Sphere>(0.5), {1, 0, 0});
  const Scalar k = 4 * body.mass_properties.mass;
  body.wrench = [k](Scalar, const MotionState& state) {
    return Wrench{-k * state.X_WB.translation(), Vector3::Zero()};
  };
  const BodyId id = world.add_body(body);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(world.advance(0.03).status, AdvanceStatus::Completed);
  EXPECT_NEAR(world.state(id).X_WB.translation().x(), std::cos(6), 1e-6);
}

TEST(World, HoldsLockedAxes) {
  World world(earth_options());
  BodyDefinition body = dynamic_body("slider", std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)),
                                     {0, 0, 0}, {1, 1, 0}, {1, 2, 3});
  body.locked.translation = {false, true, true};
  body.locked.rotation = {true, true, false};
  const BodyId id = world.add_body(body);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
  const MotionState state = world.state(id);
  EXPECT_NEAR(state.X_WB.translation().x(), 1, 1e-9);
  EXPECT_EQ(state.X_WB.translation().tail<2>().norm(), 0);
  EXPECT_EQ(state.twist.w_WB.head<2>().norm(), 0);
  EXPECT_NEAR(state.twist.w_WB.z(), 3, 1e-9);
  EXPECT_NEAR(state.X_WB.rotation()(2, 2), 1, 1e-12);
}

TEST(World, StopsAtTheImpactIfAskedTo) {
  WorldOptions options = earth_options();
  options.policy = ImpactPolicy::Stop;
  World world(options);
  const BodyId floor = world.add_body(floor_body(1, 1));
  const BodyId ball = world.add_body(bouncing_ball(1, 1));
  AdvanceReport report;
  for (int k = 0; k < 100 && report.status != AdvanceStatus::StoppedAtImpact; ++k) {
    report = world.advance(0.01);
  }
  ASSERT_EQ(report.status, AdvanceStatus::StoppedAtImpact);
  EXPECT_EQ(report.t, world.time());
  ASSERT_EQ(report.impacts.size(), 1U);
  EXPECT_EQ(report.impacts[0].a, floor);
  EXPECT_EQ(report.impacts[0].b, ball);
  EXPECT_NEAR(world.time(), std::sqrt(2 / kGravity), 1e-3);
  // It stays there until the user changes the velocity.
  EXPECT_EQ(world.advance(0.01).t, report.t);
  MotionState state = world.state(ball);
  state.twist.v_WB = Vector3(0, 0, 1);
  world.set_state(ball, state);
  EXPECT_GT(world.advance(0.01).t, report.t);
}

// Also where gravity would cause that speed within a step, and just above the floor.
TEST(World, NoLongStepHidesAnImpact) {
  for (const Scalar restitution : {0.0, 0.5}) {
    for (const Scalar height : {0.02, 0.2, 1.0}) {
      WorldOptions options = earth_options();
      options.policy = ImpactPolicy::Stop;
      World world(options);
      world.add_body(floor_body(0.5, restitution));
      const BodyId ball = world.add_body(bouncing_ball(height, restitution));
      const AdvanceReport report = world.advance(2);
      EXPECT_EQ(report.status, AdvanceStatus::StoppedAtImpact) << height;
      EXPECT_EQ(report.impacts.size(), 1U) << height;
      EXPECT_NEAR(report.t, std::sqrt(2 * height / kGravity), 2e-3) << height;
      // It is told once: the velocity is the user's to change.
      MotionState state = world.state(ball);
      state.twist = {};
      world.set_state(ball, state);
      EXPECT_EQ(world.advance(2).status, AdvanceStatus::Completed) << height;
      EXPECT_NEAR(world.time(), report.t + 2, 1e-12);
    }
  }
}

// Each fall from a hundredth of its height and more.
TEST(World, ALongStepCallsBackAtEachImpact) {
  WorldOptions options = earth_options();
  options.policy = ImpactPolicy::Callback;
  std::vector<Scalar> times;
  options.on_impact = [&](const ImpactEvent& event, ImpactStates& states) {
    times.push_back(event.t);
    states.b.twist.v_WB *= -0.5;
  };
  World world(options);
  world.add_body(floor_body(0.5, 0));
  world.add_body(bouncing_ball(1, 0));
  EXPECT_EQ(world.advance(4).status, AdvanceStatus::Completed);
  const Scalar fall = std::sqrt(2 / kGravity);
  ASSERT_GE(times.size(), 4U);
  Scalar expected = fall;
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(times[k], expected, 5e-3) << k;
    expected += 2 * fall * std::pow(0.5, k + 1);
  }
}

TEST(World, LetsACallbackChangeVelocities) {
  WorldOptions options = earth_options();
  options.policy = ImpactPolicy::Callback;
  int calls = 0;
  options.on_impact = [&](const ImpactEvent&, ImpactStates& states) {
    ++calls;
    states.b.twist.v_WB = Vector3(1, 0, 3);
  };
  options.max_step = 0.01;
  World world(options);
  world.add_body(floor_body(0, 1));
  BodyDefinition body = bouncing_ball(1, 1);
  body.friction = 0;
  const BodyId ball = world.add_body(body);
  EXPECT_EQ(world.advance(0.6).status, AdvanceStatus::Completed);
  EXPECT_EQ(calls, 1);
  EXPECT_NEAR(world.state(ball).twist.v_WB.x(), 1, 1e-9);
}

TEST(World, KeepsTargetDistancesAndFilters) {
  for (const bool is_enabled : {true, false}) {
    WorldOptions options = earth_options();
    options.max_step = 0.01;
    World world(options);
    const BodyId floor = world.add_body(floor_body(1, 1));
    const BodyId ball = world.add_body(bouncing_ball(1, 1));
    world.set_target_distance(ball, floor, 0.25);
    world.set_pair_enabled(ball, floor, is_enabled);
    const AdvanceReport report = world.advance(1);
    EXPECT_EQ(report.impacts.empty(), !is_enabled);
    Scalar lowest = 1;
    for (const CommittedStep& step : report.steps) {
      for (int i = 0; i <= 20; ++i) {
        const Scalar t = step.interval.begin + step.interval.length() * i / 20;
        lowest = std::min(lowest, step.motions[ball.slot]->pose(t).translation().z() - 0.5);
      }
    }
    if (is_enabled) {
      EXPECT_GE(lowest, 0.25);
      EXPECT_LT(lowest, 0.251);
    } else {
      EXPECT_LT(lowest, 0);
    }
  }
}

TEST(World, StrikesWithAKinematicPaddle) {
  WorldOptions options;
  options.max_step = 0.01;
  World world(options);
  BodyDefinition paddle;
  paddle.name = "paddle";
  paddle.kind = BodyKind::Kinematic;
  paddle.shape = std::make_shared<Box>(Vector3(2, 0.1, 0.5));
  paddle.motion =
      std::make_shared<ConstantTwistMotion>(RigidPose(), Twist{Vector3::Zero(), Vector3(0, 0, 1)});
  paddle.restitution = 1;
  world.add_body(paddle);
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.2), {1, 1, 0});
  ball.restitution = 1;
  ball.friction = 0;
  const BodyId id = world.add_body(ball);
  const AdvanceReport report = world.advance(2);
  ASSERT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_FALSE(report.impacts.empty());
  // Struck elastically by a wall: leaves at twice its speed there.
  EXPECT_NEAR(world.state(id).twist.v_WB.norm(),
              2 * report.impacts[0].contacts[0].contact.p_WCa.norm(), 0.1);
}

TEST(World, ReportsSpentBudgetCancellationAndDeadline) {
  WorldOptions options = earth_options();
  options.max_node_pairs = 1;
  World world(options);
  world.add_body(floor_body(1, 1));
  const BodyId box = world.add_body(dynamic_body(
      "box", std::make_shared<Box>(Vector3(0.3, 0.4, 0.5)), {0, 0, 1}, {0, 0, 0}, {1, 2, 3}));
  AdvanceReport report = world.advance(1);
  EXPECT_EQ(report.status, AdvanceStatus::BudgetExhausted);
  EXPECT_EQ(report.offending_pair.second, box);
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(world.advance(1, {source.get_token(), {}}).status, AdvanceStatus::Cancelled);
  const AdvanceLimits late{{}, std::chrono::steady_clock::now()};
  EXPECT_EQ(world.advance(1, late).status, AdvanceStatus::BudgetExhausted);
}

TEST(World, RefusesIdsOfRemovedBodiesAlsoWhenTheirSlotIsUsedAgain) {
  World world;
  const BodyId first = world.add_body(bouncing_ball(1, 0.5));
  world.remove_body(first);
  EXPECT_FALSE(world.has_body(first));
  EXPECT_EQ(world.body_count(), 0U);
  const BodyId second = world.add_body(bouncing_ball(1, 0.5));
  EXPECT_EQ(second.slot, first.slot);
  EXPECT_NE(second, first);
  EXPECT_NE(message_of([&] { world.state(first); }).find("there is no body 0 among 1"),
            std::string::npos);
}

TEST(World, SeesNothingOfADisabledBody) {
  WorldOptions options = earth_options();
  options.max_step = 0.01;
  World world(options);
  const BodyId floor = world.add_body(floor_body(1));
  const BodyId ball = world.add_body(bouncing_ball(0.1, 0));
  world.set_enabled(floor, false);
  world.advance(1);
  EXPECT_LT(world.state(ball).X_WB.translation().z(), -4);
}

TEST(World, ReportsWhenABodyOverlapsASensor) {
  WorldOptions options;
  options.max_step = 0.01;
  World world(options);
  BodyDefinition sensor;
  sensor.name = "gate";
  sensor.kind = BodyKind::Static;
  sensor.shape = std::make_shared<Box>(Vector3(0.5, 1, 1));
  sensor.is_sensor = true;
  const BodyId gate = world.add_body(sensor);
  const BodyId ball =
      world.add_body(dynamic_body("ball", std::make_shared<Sphere>(0.1), {-2, 0, 0}, {1, 0, 0}));
  const AdvanceReport report = world.advance(4);
  ASSERT_EQ(report.sensors.size(), 2U);
  EXPECT_EQ(report.sensors[0].sensor, gate);
  EXPECT_EQ(report.sensors[0].body, ball);
  EXPECT_TRUE(report.sensors[0].is_overlap);
  EXPECT_NEAR(report.sensors[0].t, 1.4, 1e-3);
  EXPECT_FALSE(report.sensors[1].is_overlap);
  EXPECT_NEAR(report.sensors[1].t, 2.6, 0.011);
  EXPECT_NEAR(world.state(ball).twist.v_WB.x(), 1, 1e-12);
}

TEST(World, ReportsAKinematicBodyThatPassesThroughAStaticOne) {
  WorldOptions options;
  options.max_step = 0.01;
  World world(options);
  BodyDefinition wall;
  wall.name = "wall";
  wall.kind = BodyKind::Static;
  wall.shape = std::make_shared<Box>(Vector3(0.1, 1, 1));
  const BodyId wall_id = world.add_body(wall);
  BodyDefinition arm;
  arm.name = "arm";
  arm.kind = BodyKind::Kinematic;
  arm.shape = std::make_shared<Sphere>(0.2);
  arm.motion = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(-1, 0, 0)),
                                                     Twist{Vector3(1, 0, 0), Vector3::Zero()});
  const BodyId arm_id = world.add_body(arm);
  const AdvanceReport report = world.advance(2);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_EQ(report.crossed.size(), 1U);
  EXPECT_EQ(report.crossed[0], std::make_pair(wall_id, arm_id));
}

TEST(World, TellsThePivotAndContactsOfNearPairs) {
  WorldOptions options = earth_options();
  options.sleep_steps = 0;
  World world(options);
  const BodyId floor = world.add_body(floor_body(0.5));
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  for (int k = 0; k < 20; ++k) world.advance(0.01);
  const std::vector<PairRecord> contacts = world.contacts();
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_EQ(contacts[0].a, floor);
  EXPECT_EQ(contacts[0].b, cube);
  EXPECT_EQ(contacts[0].proof, ProofKind::ByBound);
  EXPECT_GT(contacts[0].nhat_AB_W.z(), 0.999);
  EXPECT_NEAR(contacts[0].pivot_W.z(), 0, 1e-3);
  EXPECT_LE(contacts[0].gap_lower, contacts[0].gap_upper);
  Vector3 impulse = Vector3::Zero();
  for (const PairContact& contact : contacts[0].contacts) impulse += contact.impulse_W;
  const Scalar weight = world.body(cube).mass_properties.mass * kGravity;
  EXPECT_NEAR(impulse.z(), weight * 0.01, 1e-4 * weight * 0.01);
}

TEST(World, RefusesBadBodiesNamingBodyAndField) {
  World world;
  const auto message = [&](auto&& change) {
    BodyDefinition body = bouncing_ball(1, 0.5);
    change(body);
    return message_of([&] { world.add_body(body); });
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find("'ball'") != std::string::npos && text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(message([](auto& b) { b.mass_properties.mass = 0; }),
                  "mass must be finite and > 0, not 0"));
  EXPECT_TRUE(has(message([](auto& b) { b.mass_properties.mass = -2; }), "-2"));
  EXPECT_TRUE(
      has(message([](auto& b) { b.mass_properties.I_BBcm(2, 2) = -1; }), "positive definite"));
  EXPECT_TRUE(has(message([](auto& b) { b.mass_properties.I_BBcm(0, 2) = 1; }), "symmetric"));
  EXPECT_TRUE(has(message([](auto& b) { b.shape = nullptr; }), "shape is missing"));
  EXPECT_TRUE(has(message([](auto& b) { b.restitution = 1.5; }), "1.5"));
  EXPECT_TRUE(has(message([](auto& b) { b.friction = -1; }), "friction"));
  EXPECT_TRUE(has(message([](auto& b) { b.kind = BodyKind::Kinematic; }), "needs a motion"));
  EXPECT_TRUE(has(message([](auto& b) { b.initial.twist.v_WB.x() = std::nan(""); }), "velocity"));
  EXPECT_EQ(world.body_count(), 0U);
}

TEST(World, RefusesBadCallsNamingTheValue) {
  World world;
  const BodyId ball = world.add_body(bouncing_ball(1, 0.5));
  EXPECT_NE(message_of([&] { world.advance(0); }).find("not 0"), std::string::npos);
  EXPECT_NE(message_of([&] { world.advance(-1); }).find("-1"), std::string::npos);
  EXPECT_NE(message_of([&] { world.state(BodyId(7)); }).find("no body 7"), std::string::npos);
  EXPECT_NE(message_of([&] { world.set_target_distance(ball, ball, 1); }).find("twice"),
            std::string::npos);
  WorldOptions options;
  options.target_distance = -1;
  EXPECT_NE(message_of([&] { World bad(options); }).find("target_distance"), std::string::npos);
  options = {};
  options.solver.newton_limit = -3;
  EXPECT_EQ(message_of([&] { World bad(options); }), "newton_limit must be >= 0, not -3");
}

TEST(World, NamesTheBodyWhoseWrenchIsNotFinite) {
  World world;
  BodyDefinition body = bouncing_ball(1, 0.5);
  body.wrench = [](Scalar, const MotionState&) {
    return Wrench{Vector3(std::nan(""), 0, 0), Vector3::Zero()};
  };
  world.add_body(body);
  try {
    world.advance(0.01);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const IntegrationError& error) {
    EXPECT_NE(std::string(error.what()).find("body 'ball': its wrench callback"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace dyop
