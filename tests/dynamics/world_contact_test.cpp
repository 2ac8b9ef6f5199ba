// SPDX-License-Identifier: BSD-3-Clause

// Contact and friction against closed forms, at steps of 0.01.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kStep = 0.01;

void run(World& world, Scalar time) {
  const int steps = static_cast<int>(std::lround(time / kStep));
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(kStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
    ASSERT_TRUE(report.too_near.empty());
  }
}

// A box on a plane that is inclined by turning gravity about y, itself turned about the normal.
struct Slope {
  Slope(Scalar tangent, Scalar friction, const Vector3& half_extents, Scalar turn)
      : world(tilted(tangent)) {
    world.add_body(floor_body(friction));
    const auto shape = std::make_shared<Box>(half_extents);
    const Scalar height = half_extents.z() + rest_gap(shape->bounding_radius());
    BodyDefinition body = dynamic_body("block", shape, {0, 0, height});
    body.initial.X_WB =
        RigidPose(rotation_from_vector(Vector3(0, 0, turn)), body.initial.X_WB.translation());
    body.friction = friction;
    body.restitution = 0;
    block = world.add_body(body);
  }
  static WorldOptions tilted(Scalar tangent) {
    WorldOptions options;
    const Scalar angle = std::atan(tangent);
    options.gravity_W = kGravity * Vector3(std::sin(angle), 0, -std::cos(angle));
    return options;
  }
  World world;
  BodyId block;
};

class EveryBlock : public ::testing::TestWithParam<std::tuple<int, int>> {
 protected:
  Vector3 half_extents() const {
    switch (std::get<0>(GetParam())) {
      case 0:
        return {0.5, 0.5, 0.5};
      case 1:
        return {0.2, 0.2, 0.01};  // a plate
      default:
        return {0.6, 0.05, 0.05};  // a rod
    }
  }
  Scalar turn() const { return std::get<1>(GetParam()) * std::numbers::pi / 180; }
};

TEST_P(EveryBlock, SlidesDownASlopeThatIsTooSteep) {
  Slope slope(0.5, 0.4, half_extents(), turn());
  run(slope.world, 1);
  const Scalar angle = std::atan(0.5);
  const Scalar acceleration = kGravity * (std::sin(angle) - 0.4 * std::cos(angle));
  const MotionState state = slope.world.state(slope.block);
  EXPECT_NEAR(state.twist.v_WB.x(), acceleration, 1e-3 * acceleration);
  EXPECT_NEAR(state.X_WB.translation().x(), acceleration / 2, 1e-3 * acceleration / 2);
  EXPECT_LT(std::abs(state.twist.v_WB.y()), 1e-3 * acceleration);
  EXPECT_LT(state.twist.w_WB.norm(), 1e-3);
}

TEST_P(EveryBlock, SticksToASlopeThatIsNot) {
  Slope slope(0.5, 0.51, half_extents(), turn());
  run(slope.world, 2);
  const MotionState state = slope.world.state(slope.block);
  EXPECT_TRUE(slope.world.is_asleep(slope.block));
  EXPECT_LT(state.X_WB.translation().head<2>().norm(), 1e-5 * half_extents().norm());
}

TEST_P(EveryBlock, SlidesAsFarAsFrictionLets) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const auto shape = std::make_shared<Box>(half_extents());
  // Only flat enough not to tip.
  const Scalar speed = 2;
  BodyDefinition body =
      dynamic_body("block", shape, {0, 0, half_extents().z() + rest_gap(shape->bounding_radius())},
                   {speed, 0, 0});
  body.initial.X_WB =
      RigidPose(rotation_from_vector(Vector3(0, 0, turn())), body.initial.X_WB.translation());
  body.friction = 0.5;
  body.restitution = 0;
  const BodyId block = world.add_body(body);
  run(world, 2);
  const Scalar distance = speed * speed / (2 * 0.5 * kGravity);
  EXPECT_NEAR(world.state(block).X_WB.translation().x(), distance, 1e-3 * distance);
  EXPECT_TRUE(world.is_asleep(block));
}

INSTANTIATE_TEST_SUITE_P(World, EveryBlock,
                         ::testing::Combine(::testing::Values(0, 1, 2),
                                            ::testing::Values(0, 15, 45)));

TEST(WorldContact, SlidesUnderTheFrictionAngleItOnlyJustExceeds) {
  Slope slope(0.5, 0.49, Vector3(0.5, 0.5, 0.5), 0);
  run(slope.world, 3);
  const Scalar acceleration = kGravity * (0.5 - 0.49) * std::cos(std::atan(0.5));
  EXPECT_NEAR(slope.world.state(slope.block).twist.v_WB.x(), 3 * acceleration, 3e-3 * acceleration);
}

TEST(WorldContact, TurnsABackspinningBallAround) {
  World world(earth_options());
  world.add_body(floor_body(0.3));
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5),
                                     {0, 0, 0.5 + rest_gap(0.5)}, {3, 0, 0}, {0, -20, 0});
  ball.friction = 0.3;
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  run(world, 3);
  const Scalar expected = (5 * 3.0 - 2 * 0.5 * 20) / 7;
  EXPECT_NEAR(world.state(id).twist.v_WB.x(), expected, 5e-3 * std::abs(expected));
  EXPECT_NEAR(world.state(id).twist.w_WB.y(), expected / 0.5, 5e-3 * std::abs(expected) / 0.5);
}

TEST(WorldContact, BouncesElasticallyAtTheClosedFormTimes) {
  World world(earth_options());
  world.add_body(floor_body(0, 1));
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, 1.5});
  ball.restitution = 1;
  ball.friction = 0;
  world.add_body(ball);
  std::vector<Scalar> times;
  for (int k = 0; k < 400; ++k) {
    const AdvanceReport report = world.advance(kStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    for (const ImpactEvent& event : report.impacts) times.push_back(event.t);
  }
  const Scalar first = std::sqrt(2 / kGravity);
  ASSERT_EQ(times.size(), 4u);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Scalar expected = first * static_cast<Scalar>(2 * i + 1);
    EXPECT_NEAR(times[i], expected, 5e-3 * expected);
  }
}

TEST(WorldContact, BouncesLessEachTimeAndComesToRest) {
  World world(earth_options());
  world.add_body(floor_body(0.5, 0.5));
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5), {0, 0, 1.5});
  ball.restitution = 0.5;
  const BodyId id = world.add_body(ball);
  run(world, 3);
  EXPECT_TRUE(world.is_asleep(id));
  EXPECT_NEAR(world.state(id).X_WB.translation().z(), 0.5 + rest_gap(0.5), 1e-4);
}

TEST(WorldContact, PassesTheSpeedOnThroughARowOfBalls) {
  WorldOptions options;
  World world(options);
  const auto shape = std::make_shared<Sphere>(0.5);
  std::vector<BodyId> balls;
  for (int i = 0; i < 5; ++i) {
    BodyDefinition ball = dynamic_body("ball", shape, {i == 0 ? -2 : 1.01 * i, 0, 0});
    if (i == 0) ball.initial.twist.v_WB = Vector3(1, 0, 0);
    ball.restitution = 1;
    ball.friction = 0;
    balls.push_back(world.add_body(ball));
  }
  run(world, 3);
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(world.state(balls[static_cast<std::size_t>(i)]).twist.v_WB.x(), i == 4 ? 1 : 0,
                5e-3);
  }
  EXPECT_NEAR(world.kinetic_energy() / (0.5 * world.body(balls[0]).mass_properties.mass), 1, 1e-9);
}

TEST(WorldContact, KeepsAStackOfTenWhereItIs) {
  World world(earth_options());
  add_columns(world, 1, 10);
  const std::vector<BodyId> ids = world.bodies();
  std::vector<Vector3> before;
  for (const BodyId id : ids) before.push_back(world.state(id).X_WB.translation());
  run(world, 2);
  for (std::size_t i = 1; i < ids.size(); ++i) {
    EXPECT_TRUE(world.is_asleep(ids[i])) << i;
    const Vector3 moved = world.state(ids[i]).X_WB.translation() - before[i];
    EXPECT_LT(moved.head<2>().norm(), 1e-6);
    EXPECT_LT(std::abs(moved.z()), 1e-3);  // every gap within its rest offset
  }
}

TEST(WorldContact, FallsWhenItsLiftLeaves) {
  World world(earth_options());
  BodyDefinition lift;
  lift.name = "lift";
  lift.kind = BodyKind::Kinematic;
  lift.shape = std::make_shared<Box>(Vector3(2, 2, 0.1));
  lift.motion = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(0, 0, -0.1)), Twist{});
  const BodyId lift_id = world.add_body(lift);
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  run(world, 1);
  ASSERT_TRUE(world.is_asleep(cube));
  // Faster than free fall.
  world.set_motion(lift_id, std::make_shared<ConstantTwistMotion>(
                                RigidPose(Vector3(0, 0, -0.1)),
                                Twist{Vector3(0, 0, -20), Vector3::Zero()}, world.time()));
  run(world, 0.5);
  EXPECT_FALSE(world.is_asleep(cube));
  EXPECT_NEAR(world.state(cube).twist.v_WB.z(), -kGravity * 0.5, 0.05);
}

TEST(WorldContact, FallsWhenItsSupportIsRemoved) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const BodyId lower = world.add_body(resting_cube(0, 0, 0));
  const Scalar top = world.state(lower).X_WB.translation().z() + 0.5;
  const BodyId upper = world.add_body(resting_cube(0, 0, top));
  run(world, 1);
  ASSERT_TRUE(world.is_asleep(upper));
  world.remove_body(lower);
  EXPECT_FALSE(world.is_asleep(upper));
  run(world, 2);
  EXPECT_NEAR(world.state(upper).X_WB.translation().z(), 0.5, 0.01);
}

TEST(WorldContact, WakesWhenAForceChanges) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  run(world, 1);
  ASSERT_TRUE(world.is_asleep(cube));
  const Scalar weight = world.body(cube).mass_properties.mass * kGravity;
  world.set_wrench(cube, [weight](Scalar, const MotionState&) {
    return Wrench{Vector3(0.7 * weight, 0, 0), Vector3::Zero()};
  });
  run(world, 0.5);
  EXPECT_NEAR(world.state(cube).twist.v_WB.x(), 0.2 * kGravity * 0.5, 0.02 * kGravity * 0.5);
  world.set_wrench(cube, {});
  run(world, 3);
  EXPECT_TRUE(world.is_asleep(cube));
  world.set_gravity(Vector3(0, 0, kGravity));
  run(world, 0.1);
  EXPECT_GT(world.state(cube).twist.v_WB.z(), 0.9);
}

TEST(WorldContact, WakesASleeperThatIsStruck) {
  World world(earth_options());
  world.add_body(floor_body(0.3, 0.3));
  BodyDefinition resting = dynamic_body("resting", std::make_shared<Sphere>(0.5), {0, 0, 0.501});
  const BodyId id = world.add_body(resting);
  run(world, 2);
  ASSERT_TRUE(world.is_asleep(id));
  world.add_body(dynamic_body("striker", std::make_shared<Sphere>(0.5), {-3, 0, 0.6}, {6, 0, 2}));
  run(world, 1);
  EXPECT_GT(world.state(id).X_WB.translation().x(), 0.1);
}

TEST(WorldContact, CarriesABoxOnAMovingPlatform) {
  World world(earth_options());
  BodyDefinition platform;
  platform.name = "platform";
  platform.kind = BodyKind::Kinematic;
  platform.shape = std::make_shared<Box>(Vector3(5, 5, 0.1));
  platform.motion = std::make_shared<ConstantTwistMotion>(
      RigidPose(Vector3(0, 0, -0.1)), Twist{Vector3(0.5, 0, 0), Vector3::Zero()});
  world.add_body(platform);
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  run(world, 2);
  EXPECT_NEAR(world.state(cube).twist.v_WB.x(), 0.5, 1e-3);
  EXPECT_FALSE(world.is_asleep(cube));
}

TEST(WorldContact, DoesNotTunnelThroughAThinPlate) {
  World world;
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

// Within reach of what it moves in a step, but it comes no nearer to them.
TEST(WorldContact, SeeksNoContactsWithWallsThatABodySlidesAlong) {
  World world(earth_options());
  BodyDefinition channel = floor_body(0);
  const Scalar beside = 0.5 + 0.01;
  const auto bottom = std::make_shared<Box>(Vector3(20, 2, 1));
  const auto wall = std::make_shared<Box>(Vector3(20, 0.5, 0.5));
  channel.shape = std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{bottom, {}},
                                 {wall, RigidPose(Vector3(0, beside + 0.5, 1.5))},
                                 {wall, RigidPose(Vector3(0, -beside - 0.5, 1.5))}});
  world.add_body(channel);
  BodyDefinition cube = resting_cube(0, 0, 0, 0);
  cube.initial.twist.v_WB = Vector3(3, 0, 0);
  const BodyId id = world.add_body(cube);
  run(world, 0.1);
  EXPECT_EQ(world.advance(kStep).work.contacts, 4);
  // Thrown at a wall, it meets that within the next step.
  MotionState state = world.state(id);
  state.twist.v_WB = Vector3(3, 2, 0);
  world.set_state(id, state);
  run(world, 0.02);
  EXPECT_GT(world.advance(kStep).work.contacts, 4);
  const MotionState met = world.state(id);
  EXPECT_NEAR(met.twist.v_WB.x(), 3, 1e-9);
  // So few bodies are solved to 1e-6 of their speed.
  EXPECT_LT(std::abs(met.twist.v_WB.y()), 1e-6 * met.twist.v_WB.norm());
  // A gap that a hit left too small is recovered by three tenths a step.
  const Scalar rest = rest_gap(std::sqrt(0.75));
  EXPECT_NEAR(met.X_WB.translation().y(), 0.01 - rest, 0.05 * rest);
}

TEST(WorldContact, ReportsABodyThatIsSqueezed) {
  World world;
  for (const Scalar side : {-1.0, 1.0}) {
    BodyDefinition jaw;
    jaw.name = "jaw";
    jaw.kind = BodyKind::Kinematic;
    jaw.shape = std::make_shared<Box>(Vector3(0.5, 2, 2));
    jaw.motion = std::make_shared<ConstantTwistMotion>(
        RigidPose(Vector3(1.2 * side, 0, 0)), Twist{Vector3(-0.5 * side, 0, 0), Vector3::Zero()});
    world.add_body(jaw);
  }
  world.add_body(dynamic_body("cube", std::make_shared<Box>(Vector3(0.5, 0.5, 0.5)), {0, 0, 0}));
  AdvanceReport report;
  for (int k = 0; k < 100 && report.status != AdvanceStatus::Blocked; ++k) {
    report = world.advance(kStep);
  }
  EXPECT_EQ(report.status, AdvanceStatus::Blocked);
  EXPECT_GT(world.time(), 0.3);
  EXPECT_LT(world.time(), 0.401);  // when the jaws touch both sides
}

TEST(WorldContact, PushesBodiesApartThatBeginTooNearAndStepsTheRest) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  BodyDefinition sunk = resting_cube(0, 0, 0);
  sunk.initial.X_WB = RigidPose(Vector3(0, 0, 0.5));  // exactly on the floor
  const BodyId cube = world.add_body(sunk);
  const BodyId far = world.add_body(dynamic_body("far", std::make_shared<Sphere>(0.1), {5, 0, 3}));
  AdvanceReport report = world.advance(kStep);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  ASSERT_EQ(report.too_near.size(), 1u);
  EXPECT_EQ(report.too_near[0].second, cube);
  for (int k = 0; k < 100; ++k) report = world.advance(kStep);
  EXPECT_EQ(report.work.pairs_excused, 0);
  EXPECT_NEAR(world.state(cube).X_WB.translation().z(), 0.5 + rest_gap(std::sqrt(0.75)), 2e-4);
  EXPECT_LT(world.state(far).X_WB.translation().z(), 0.2);
}

}  // namespace
}  // namespace dyop
