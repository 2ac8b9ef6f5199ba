#include "dyop/dynamics/world.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/sphere.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/constant_twist_motion.h"
#include "support/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::message_of;

BodyDefinition dynamic_body(const std::string& name, std::shared_ptr<const Shape> shape,
                            const Vector3& p, const Vector3& v = Vector3::Zero(),
                            const Vector3& w = Vector3::Zero()) {
  BodyDefinition body;
  body.name = name;
  body.shape = std::move(shape);
  body.mass_properties = body.shape->compute_mass_properties(1000);
  body.initial = {RigidPose(p), Twist{v, w}};
  return body;
}

BodyDefinition floor_body(Scalar restitution) {
  BodyDefinition body;
  body.name = "floor";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Box>(Vector3(10, 10, 1));
  body.initial.X_WB = RigidPose(Vector3(0, 0, -1));  // its top is z = 0
  body.restitution = restitution;
  return body;
}

BodyDefinition ball_at(Scalar height, Scalar restitution) {
  BodyDefinition body = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, height + 0.5});
  body.restitution = restitution;
  return body;
}

TEST(World, FallsFreelyAsGalileoSays) {
  World world;
  const BodyId ball = world.add_body(
      dynamic_body("ball", std::make_shared<Sphere>(0.5), {1, 2, 3}, {4, -1, 2}, {0, 0, 5}));
  const AdvanceReport report = world.advance(2);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_EQ(report.t, 2);
  const Vector3 expected = Vector3(1, 2, 3) + 2 * Vector3(4, -1, 2) + 2 * Vector3(0, 0, -9.81);
  EXPECT_LT((world.state(ball).X_WB.translation() - expected).norm(), 1e-10);
  EXPECT_LT((world.state(ball).twist.w_WB - Vector3(0, 0, 5)).norm(), 1e-10);
  // The trajectory in between is the parabola, too.
  for (const CommittedStep& step : report.steps) {
    const Scalar t = step.interval.begin + 0.37 * step.interval.length();
    const Scalar z = 3 + 2 * t - 9.81 * t * t / 2;
    EXPECT_NEAR(step.motions[0]->pose(t).translation().z(), z, 1e-10);
  }
}

TEST(World, FlipsAFreeTopAboutItsIntermediateAxisAndKeepsEnergyAndMomentum) {
  WorldOptions options;
  options.gravity_W = Vector3::Zero();
  for (const IntegratorKind kind :
       {IntegratorKind::Arkode, IntegratorKind::CvodeAdams, IntegratorKind::CvodeBdf}) {
    options.integrator = kind;
    World world(options);
    const BodyId top = world.add_body(dynamic_body(
        "top", std::make_shared<Box>(Vector3(0.5, 0.3, 0.1)), {0, 0, 0}, {0, 0, 0}, {0.01, 6, 0}));
    const Scalar energy = world.kinetic_energy();
    const Vector3 momentum = world.angular_momentum();
    Scalar lowest = 1;
    for (int i = 0; i < 100; ++i) {
      ASSERT_EQ(world.advance(0.1).status, AdvanceStatus::Completed);
      lowest = std::min(lowest, world.state(top).X_WB.rotation()(1, 1));
    }
    EXPECT_LT(lowest, -0.9);  // the y axis of the body turned over
    EXPECT_NEAR(world.kinetic_energy() / energy, 1, 1e-5);
    EXPECT_LT((world.angular_momentum() - momentum).norm() / momentum.norm(), 1e-9);
  }
}

TEST(World, BouncesElasticallyAtTheClosedFormTimes) {
  // From height h the first impact is at sqrt(2 h / g), then every 2 sqrt(2 h / g).
  World world;
  world.add_body(floor_body(1));
  BodyDefinition ball = ball_at(1, 1);
  ball.friction = 0;
  world.add_body(ball);
  const AdvanceReport report = world.advance(5);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  const Scalar first = std::sqrt(2 / 9.81);
  ASSERT_EQ(report.impacts.size(), 6u);
  for (std::size_t i = 0; i < report.impacts.size(); ++i) {
    // Each stop is up to 1e-6 radii early; the error of the period adds up.
    EXPECT_NEAR(report.impacts[i].t, first * static_cast<Scalar>(2 * i + 1),
                2e-6 * static_cast<Scalar>(i + 1));
    EXPECT_EQ(report.impacts[i].contacts.size(), 1u);
  }
  EXPECT_LT(world.state(1).X_WB.translation().z(), 1.5 + 1e-5);
}

TEST(World, SettlesAnInelasticBallAndSaysSo) {
  World world;
  world.add_body(floor_body(0.5));
  const BodyId ball = world.add_body(ball_at(1, 0.5));
  const AdvanceReport report = world.advance(10);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_EQ(report.settled, std::vector<BodyId>{ball});
  EXPECT_TRUE(report.impacts.back().settled);
  EXPECT_TRUE(world.is_settled(ball));
  // Total time of a ball with coefficient e: sqrt(2 h / g) (1 + e) / (1 - e) = 1.354.
  EXPECT_NEAR(report.impacts.back().t, 3 * std::sqrt(2 / 9.81), 0.1);
  EXPECT_NEAR(world.state(ball).X_WB.translation().z(), 0.5, 2e-6);
}

TEST(World, LaysABoxDownOnItsFourCorners) {
  World world;
  world.add_body(floor_body(0.2));
  const BodyId box =
      world.add_body(dynamic_body("box", std::make_shared<Box>(Vector3(0.5, 0.4, 0.3)), {0, 0, 1}));
  const AdvanceReport report = world.advance(5);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_FALSE(report.impacts.empty());
  EXPECT_GE(report.impacts.front().contacts.size(), 4u);
  EXPECT_TRUE(world.is_settled(box));
  EXPECT_NEAR(world.state(box).X_WB.translation().z(), 0.3, 2e-6);
  EXPECT_GT(world.state(box).X_WB.rotation()(2, 2), 1 - 1e-6);
}

// Over the inner edges of a floor of triangles: only friction, mu g t, takes speed away.
TEST(World, SlidesOverTheEdgesOfAMeshAsCoulombSays) {
  World world;
  BodyDefinition floor = floor_body(0);
  floor.shape = std::make_shared<TriangleMesh>(test_support::plate_grid(4, 4, 16, 16).mesh());
  floor.initial.X_WB = RigidPose();
  floor.friction = 0.1;
  world.add_body(floor);
  const auto cube =
      std::make_shared<TriangleMesh>(test_support::box_mesh(Vector3(0.1, 0.1, 0.1)).mesh());
  BodyDefinition body = dynamic_body("cube", cube, {-1, 0, 0.1005}, {1.5, 0.3, 0});
  body.restitution = 0;
  body.friction = 0.1;
  const BodyId id = world.add_body(body);
  const AdvanceReport report = world.advance(0.2);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  const MotionState& state = world.state(id);
  const Vector3 expected = Vector3(1.5, 0.3, 0) * (1 - 0.1 * 9.81 * 0.2 / std::hypot(1.5, 0.3));
  EXPECT_LT((state.twist.v_WB - expected).norm(), 0.05 * expected.norm());
  EXPECT_LT(state.twist.w_WB.norm(), 0.1);
  EXPECT_NEAR(state.X_WB.translation().z(), 0.1, 1e-4);
}

TEST(World, WakesASettledBodyThatIsStruck) {
  World world;
  world.add_body(floor_body(0.3));
  const BodyId resting = world.add_body(ball_at(0.01, 0.3));
  ASSERT_EQ(world.advance(3).status, AdvanceStatus::Completed);
  ASSERT_TRUE(world.is_settled(resting));
  world.add_body(
      dynamic_body("striker", std::make_shared<Sphere>(0.5), {-3, 0, 0.6}, {6, 0, 2}, {0, 0, 0}));
  world.advance(0.5);
  EXPECT_FALSE(world.is_settled(resting));
  EXPECT_GT(world.state(resting).twist.v_WB.x(), 0.5);
}

TEST(World, StopsAtTheImpactIfAskedTo) {
  WorldOptions options;
  options.policy = ImpactPolicy::Stop;
  World world(options);
  world.add_body(floor_body(1));
  const BodyId ball = world.add_body(ball_at(1, 1));
  const AdvanceReport report = world.advance(5);
  EXPECT_EQ(report.status, AdvanceStatus::StoppedAtImpact);
  EXPECT_EQ(report.t, world.time());
  ASSERT_EQ(report.impacts.size(), 1u);
  EXPECT_EQ(report.impacts[0].a, 0);
  EXPECT_EQ(report.impacts[0].b, ball);
  EXPECT_GT(world.state(ball).X_WB.translation().z(), 0.5);
  EXPECT_LT(world.state(ball).X_WB.translation().z(), 0.5 + 1e-6);
  // It stays there until the user changes the velocity.
  EXPECT_EQ(world.advance(1).t, report.t);
  MotionState state = world.state(ball);
  state.twist.v_WB = Vector3(0, 0, 1);
  world.set_state(ball, state);
  EXPECT_GT(world.advance(0.1).t, report.t);
}

TEST(World, LetsACallbackChangeVelocities) {
  WorldOptions options;
  options.policy = ImpactPolicy::Callback;
  int calls = 0;
  options.on_impact = [&](const ImpactEvent& event, std::vector<MotionState>& states) {
    ++calls;
    states[static_cast<std::size_t>(event.b)].twist.v_WB = Vector3(1, 0, 3);
  };
  World world(options);
  world.add_body(floor_body(1));
  const BodyId ball = world.add_body(ball_at(1, 1));
  EXPECT_EQ(world.advance(0.6).status, AdvanceStatus::Completed);
  EXPECT_EQ(calls, 1);
  EXPECT_NEAR(world.state(ball).twist.v_WB.x(), 1, 1e-9);
}

TEST(World, KeepsMarginsAndFilters) {
  for (const bool is_enabled : {true, false}) {
    World world;
    const BodyId floor = world.add_body(floor_body(1));
    const BodyId ball = world.add_body(ball_at(1, 1));
    world.set_margin(ball, floor, 0.25);
    world.set_pair_enabled(ball, floor, is_enabled);
    const AdvanceReport report = world.advance(1);
    EXPECT_EQ(report.impacts.empty(), !is_enabled);
    Scalar lowest = 1;
    for (const CommittedStep& step : report.steps) {
      for (int i = 0; i <= 100; ++i) {
        const Scalar t = step.interval.begin + step.interval.length() * i / 100;
        lowest = std::min(lowest, step.motions[1]->pose(t).translation().z() - 0.5);
      }
    }
    if (is_enabled) {
      EXPECT_GE(lowest, 0.25);
      EXPECT_LT(lowest, 0.25 + 1e-6);
    } else {
      EXPECT_LT(lowest, 0);
    }
  }
}

TEST(World, DoesNotTunnelThroughAThinPlate) {
  WorldOptions options;
  options.gravity_W = Vector3::Zero();
  World world(options);
  BodyDefinition plate;
  plate.name = "plate";
  plate.kind = BodyKind::Static;
  plate.shape = std::make_shared<Box>(Vector3(5, 5, 1e-4));
  world.add_body(plate);
  const BodyId bullet =
      world.add_body(dynamic_body("bullet", std::make_shared<Box>(Vector3(0.02, 0.03, 0.01)),
                                  {0, 0, 3}, {1, 2, -900}, {200, -300, 100}));
  const AdvanceReport report = world.advance(0.05);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_FALSE(report.impacts.empty());
  EXPECT_GT(world.state(bullet).X_WB.translation().z(), 0);
}

TEST(World, StrikesWithAKinematicPaddle) {
  WorldOptions options;
  options.gravity_W = Vector3::Zero();
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
  world.add_body(ball);
  const AdvanceReport report = world.advance(2);
  ASSERT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_FALSE(report.impacts.empty());
  // Struck elastically at radius about 1.4 by a wall of speed about 1.4: leaves at twice that.
  EXPECT_NEAR(world.state(1).twist.v_WB.norm(),
              2 * report.impacts[0].contacts[0].contact.p_WCa.norm(), 0.1);
}

TEST(World, ReportsAnInitialOverlapAndDoesNotMove) {
  World world;
  world.add_body(floor_body(1));
  const BodyId ball = world.add_body(ball_at(-0.1, 1));
  const AdvanceReport report = world.advance(1);
  EXPECT_EQ(report.status, AdvanceStatus::InitialOverlap);
  EXPECT_EQ(report.offending_pair, std::make_pair(0, ball));
  EXPECT_EQ(world.time(), 0);
}

TEST(World, ReportsSpentBudgetAndCancellation) {
  WorldOptions options;
  options.max_node_pairs = 1;
  World world(options);
  world.add_body(floor_body(1));
  world.add_body(ball_at(1, 1));
  AdvanceReport report = world.advance(1);
  EXPECT_EQ(report.status, AdvanceStatus::BudgetExhausted);
  EXPECT_EQ(report.offending_pair, std::make_pair(0, 1));
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(world.advance(1, source.get_token()).status, AdvanceStatus::Cancelled);
}

TEST(World, EndsAtTheImpactLimitInsteadOfHanging) {
  WorldOptions options;
  options.max_impacts_per_advance = 3;
  World world(options);
  world.add_body(floor_body(1));
  world.add_body(ball_at(0.1, 1));
  const AdvanceReport report = world.advance(10);
  EXPECT_EQ(report.status, AdvanceStatus::ImpactLimit);
  EXPECT_EQ(report.impacts.size(), 3u);
  EXPECT_LT(world.time(), 10);
}

// Everything a run produced, as bytes.
std::string bytes_of_run(int threads) {
  WorldOptions options;
  options.threads = threads;
  World world(options);
  world.add_body(floor_body(0.4));
  for (int i = 0; i < 4; ++i) {
    world.add_body(dynamic_body("box", std::make_shared<Box>(Vector3(0.3, 0.2, 0.25)),
                                {0.1 * i, 0.05 * i, 1 + 0.8 * i}, {0, 0, 0}, {1.0 * i, 2, 3}));
  }
  std::string bytes;
  const auto add = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const AdvanceReport report = world.advance(0.6);
  for (const ImpactEvent& event : report.impacts) {
    add(event.t);
    for (const WorldContact& contact : event.contacts) add(contact.impulse_W);
  }
  for (std::size_t i = 0; i < world.body_count(); ++i) {
    add(world.state(static_cast<BodyId>(i)).X_WB.rotation());
    add(world.state(static_cast<BodyId>(i)).twist.v_WB);
  }
  EXPECT_GT(report.impacts.size(), 3u);
  return bytes;
}

TEST(WorldDeterminism, GivesTheSameBytesForEveryNumberOfThreads) {
  const std::string one = bytes_of_run(1);
  EXPECT_EQ(bytes_of_run(2), one);
  EXPECT_EQ(bytes_of_run(4), one);
  EXPECT_EQ(bytes_of_run(0), one);
}

TEST(World, RefusesBadBodiesNamingBodyAndField) {
  World world;
  const auto message = [&](auto&& change) {
    BodyDefinition body = ball_at(1, 0.5);
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
  EXPECT_EQ(world.body_count(), 0u);
}

TEST(World, RefusesBadCallsNamingTheValue) {
  World world;
  world.add_body(ball_at(1, 0.5));
  EXPECT_NE(message_of([&] { world.advance(0); }).find("not 0"), std::string::npos);
  EXPECT_NE(message_of([&] { world.advance(-1); }).find("-1"), std::string::npos);
  EXPECT_NE(message_of([&] { world.state(7); }).find("no body 7"), std::string::npos);
  EXPECT_NE(message_of([&] { world.set_margin(0, 0, 1); }).find("twice"), std::string::npos);
  WorldOptions options;
  options.margin = -1;
  EXPECT_NE(message_of([&] { World bad(options); }).find("margin"), std::string::npos);
}

}  // namespace
}  // namespace dyop
