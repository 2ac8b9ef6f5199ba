// SPDX-License-Identifier: BSD-3-Clause

// Rolling, impacts through rows of bodies, and how curved contact converges with the step.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

void advance_all(World& world, Scalar time, Scalar h) {
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
  }
}

WorldOptions inclined(Scalar angle) {
  WorldOptions options;
  options.gravity_W = kGravity * Vector3(std::sin(angle), 0, -std::cos(angle));
  return options;
}

// A body that lies on an incline about y and rolls down with g sin / (1 + I / (m r^2)).
void expect_rolling(const std::shared_ptr<const Shape>& shape, const Matrix3& R, Scalar radius) {
  constexpr Scalar kAngle = 0.3;
  World world(inclined(kAngle));
  world.add_body(floor_body(0.8));
  BodyDefinition body =
      dynamic_body("roller", shape, {0, 0, radius + rest_gap(shape->bounding_radius())});
  body.initial.X_WB = RigidPose(R, body.initial.X_WB.translation());
  body.friction = 0.8;
  body.restitution = 0;
  const BodyId id = world.add_body(body);
  advance_all(world, 1, 0.01);
  const Matrix3 I = R * body.mass_properties.I_BBcm * R.transpose();
  const Scalar ratio = I(1, 1) / (body.mass_properties.mass * radius * radius);
  const Scalar acceleration = kGravity * std::sin(kAngle) / (1 + ratio);
  const MotionState state = world.state(id);
  EXPECT_NEAR(state.twist.v_WB.x(), acceleration, 5e-3 * acceleration);
  EXPECT_NEAR(state.X_WB.translation().x(), acceleration / 2, 5e-3 * acceleration);
  EXPECT_NEAR(state.twist.w_WB.y(), acceleration / radius, 5e-3 * acceleration / radius);
}

TEST(WorldPhysics, RollsABallDownASlope) {
  expect_rolling(std::make_shared<Sphere>(0.5), Matrix3::Identity(), 0.5);
}

TEST(WorldPhysics, RollsACapsuleDownASlope) {
  expect_rolling(std::make_shared<Capsule>(0.3, 0.6),
                 rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0)), 0.3);
}

TEST(WorldPhysics, StopsARollingBallByRollingFriction) {
  World world(earth_options());
  BodyDefinition floor = floor_body(0.5);
  floor.rolling_friction = 0.01;
  world.add_body(floor);
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5),
                                     {0, 0, 0.5 + rest_gap(0.5)}, {1, 0, 0}, {0, 2, 0});
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  // The torque rho m g slows rolling by rho g / (r (1 + 2/5)) to a stop at v^2 / (2 a).
  const Scalar slowing = 0.01 * kGravity / (0.5 * 1.4);
  advance_all(world, 1 / slowing + 2, 0.01);
  EXPECT_NEAR(world.state(id).X_WB.translation().x(), 1 / (2 * slowing), 5e-3 / slowing);
  EXPECT_LT(world.state(id).twist.v_WB.norm(), 1e-6);
}

TEST(WorldPhysics, StopsASpinningBallByTorsionalFriction) {
  World world(earth_options());
  BodyDefinition floor = floor_body(0.5);
  floor.torsional_friction = 0.02;
  world.add_body(floor);
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.5),
                                     {0, 0, 0.5 + rest_gap(0.5)}, {0, 0, 0}, {0, 0, 4});
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  // The torque tau m g slows a spin by tau g / (2/5 r^2).
  const Scalar slowing = 0.02 * kGravity / (0.4 * 0.25);
  advance_all(world, 1, 0.01);
  EXPECT_NEAR(world.state(id).twist.w_WB.z(), 4 - slowing, 5e-3 * slowing);
  advance_all(world, 2, 0.01);
  EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-6);
}

// Newton's cradle with balls that touch: so many go as come.
void expect_cradle(int thrown, bool is_closed) {
  World world{WorldOptions{}};
  const auto shape = std::make_shared<Sphere>(0.5);
  const Scalar pitch = is_closed ? 1 + rest_gap(0.5) : 1.01;
  std::vector<BodyId> balls;
  for (int i = 0; i < 5; ++i) {
    BodyDefinition ball = dynamic_body("ball", shape, {pitch * i - (i < thrown ? 1 : 0), 0, 0});
    if (i < thrown) ball.initial.twist.v_WB = Vector3(1, 0, 0);
    ball.restitution = 1;
    ball.friction = 0;
    balls.push_back(world.add_body(ball));
  }
  advance_all(world, 3, 0.01);
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(world.state(balls[std::size_t(i)]).twist.v_WB.x(), i >= 5 - thrown ? 1 : 0, 5e-3)
        << "ball " << i << " of " << thrown << " thrown, closed " << is_closed;
  }
  const Scalar energy = 0.5 * world.body(balls[0]).mass_properties.mass * thrown;
  EXPECT_NEAR(world.kinetic_energy() / energy, 1, 1e-9);
}

TEST(WorldPhysics, PassesAsManyBallsOnAsAreThrown) {
  for (const int thrown : {1, 2, 3}) {
    for (const bool is_closed : {false, true}) expect_cradle(thrown, is_closed);
  }
}

// A light ball on a heavy one that falls on the floor: thrown up at (3 M - m) / (M + m) times the
// speed of the fall.
TEST(WorldPhysics, ThrowsALightBallUpFromAHeavyOne) {
  World world(earth_options());
  world.add_body(floor_body(0, 1));
  BodyDefinition heavy = dynamic_body("heavy", std::make_shared<Sphere>(0.5), {0, 0, 1.5});
  BodyDefinition light = dynamic_body("light", std::make_shared<Sphere>(0.1), {0, 0, 2.11});
  heavy.restitution = light.restitution = 1;
  heavy.friction = light.friction = 0;
  world.add_body(heavy);
  const BodyId top = world.add_body(light);
  const Scalar M = heavy.mass_properties.mass;
  const Scalar m = light.mass_properties.mass;
  const Scalar fall = std::sqrt(2 * kGravity * 1.0);
  advance_all(world, 0.6, 0.01);
  const Scalar up = fall * (3 * M - m) / (M + m);
  const Scalar late = 0.6 - fall / kGravity;
  EXPECT_NEAR(world.state(top).twist.v_WB.z(), up - kGravity * late, 0.01 * up);
}

// A plate that falls flat on two supports bounces flat.
TEST(WorldPhysics, BouncesAPlateFlatOffTwoSupports) {
  World world(earth_options());
  for (const Scalar x : {-0.8, 0.8}) {
    BodyDefinition support;
    support.name = "support";
    support.kind = BodyKind::Static;
    support.shape = std::make_shared<Box>(Vector3(0.1, 0.5, 0.5));
    support.initial.X_WB = RigidPose(Vector3(x, 0, -0.5));
    support.restitution = 0.5;
    world.add_body(support);
  }
  BodyDefinition plate =
      dynamic_body("plate", std::make_shared<Box>(Vector3(1, 0.4, 0.05)), {0, 0, 1});
  plate.restitution = 0.5;
  const BodyId id = world.add_body(plate);
  advance_all(world, 0.5, 0.01);
  const MotionState state = world.state(id);
  EXPECT_LT(state.twist.w_WB.norm(), 1e-6);
  EXPECT_GT(state.twist.v_WB.z(), 0);
}

// Energy that a ball gains or loses as it slides or rolls off a fixed ball for some time.
Scalar energy_error_off_a_ball(Scalar friction, Scalar h) {
  World world(earth_options());
  BodyDefinition fixed;
  fixed.name = "fixed";
  fixed.kind = BodyKind::Static;
  fixed.shape = std::make_shared<Sphere>(1);
  fixed.friction = friction;
  world.add_body(fixed);
  const Scalar reach = 1.25 + rest_gap(0.25);
  constexpr Scalar kLean = 0.2;
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(0.25),
                                     reach * Vector3(std::sin(kLean), 0, std::cos(kLean)));
  ball.friction = friction;
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  const Scalar mass = ball.mass_properties.mass;
  const Scalar start = mass * kGravity * ball.initial.X_WB.translation().z();
  advance_all(world, 0.6, h);
  return world.kinetic_energy() + mass * kGravity * world.state(id).X_WB.translation().z() - start;
}

TEST(WorldPhysics, KeepsEnergyAtSecondOrderOffABall) {
  for (const Scalar friction : {0.0, 0.9}) {
    const Scalar coarse = std::abs(energy_error_off_a_ball(friction, 0.01));
    const Scalar fine = std::abs(energy_error_off_a_ball(friction, 0.005));
    EXPECT_GT(coarse / fine, 3) << friction;
    EXPECT_LT(coarse, 0.2) << friction;  // of some 80 joules in motion
  }
}

// Housner's block: rocking about one edge it keeps 1 - 3/2 sin^2(alpha) of its spin as it lands on
// the other; alpha is the slope of its diagonal.
Scalar spin_ratio_of_rocking_block(Scalar h) {
  World world(earth_options());
  world.add_body(floor_body(1));
  const Vector3 half(0.1, 0.3, 0.4);
  const Scalar alpha = std::atan(half.x() / half.z());
  const auto shape = std::make_shared<Box>(half);
  // Turned about the edge at x = half.x, y axis, by 0.6 alpha.
  const Scalar lean = 0.6 * alpha;
  const Matrix3 R = rotation_from_vector(Vector3(0, lean, 0));
  const Scalar gap = rest_gap(shape->bounding_radius());
  BodyDefinition block = dynamic_body("block", shape, {0, 0, 0});
  block.initial.X_WB =
      RigidPose(R, Vector3(half.x(), 0, gap) - R * Vector3(half.x(), 0, -half.z()));
  block.friction = 1;
  block.restitution = 0;
  const BodyId id = world.add_body(block);
  Scalar before = 0;
  for (int k = 0; k < static_cast<int>(2 / h); ++k) {
    const AdvanceReport report = world.advance(h);
    if (report.status != AdvanceStatus::Completed) return 0;
    const Scalar spin = world.state(id).twist.w_WB.y();
    const Scalar angle = rotation_vector(world.state(id).X_WB.rotation()).y();
    if (angle < -0.1 * lean) {
      // Backwards in energy to the landing: spin^2 at an angle follows from the fall.
      const Scalar radius = std::hypot(half.x(), half.z());
      const Scalar mass = block.mass_properties.mass;
      const Scalar inertia = block.mass_properties.I_BBcm(1, 1) + mass * radius * radius;
      const auto height = [&](Scalar turn) { return radius * std::cos(alpha - std::abs(turn)); };
      const Scalar work = 2 * mass * kGravity / inertia;
      const Scalar landed = spin * spin + work * (height(angle) - height(0));
      before = work * (height(lean) - height(0));
      return std::sqrt(landed / before);
    }
  }
  return 0;
}

TEST(WorldPhysics, RocksAsHousnerSays) {
  const Scalar alpha = std::atan(0.25);
  const Scalar expected = 1 - 1.5 * std::pow(std::sin(alpha), 2);
  const Scalar coarse = std::abs(spin_ratio_of_rocking_block(0.01) - expected);
  const Scalar fine = std::abs(spin_ratio_of_rocking_block(0.0025) - expected);
  EXPECT_LT(fine, 0.03);
  EXPECT_LT(fine, coarse + 0.01);
}

// A plate under 81 cubes, more than 300 contacts in one island, on a slope that is a little steeper
// than friction holds: by so little that in a step it slides by less than a rest offset at first.
TEST(WorldPhysics, LargeIslandsThatSlideSlowlyGoAsFarAsFrictionLets) {
  constexpr Scalar kPlateOnFloor = 0.4;  // sqrt(0.8 * 0.2)
  constexpr Scalar kExcess = 1e-3;
  const Scalar angle =
      std::atan(kPlateOnFloor) + std::asin(kExcess / std::hypot(Scalar{1}, kPlateOnFloor));
  World world(inclined(angle));
  world.add_body(floor_body(0.2));
  const auto plate_shape = std::make_shared<Box>(Vector3(0.55, 0.55, 0.05));
  const auto cube_shape = std::make_shared<Box>(Vector3(0.05, 0.05, 0.05));
  const Scalar z_plate = 0.05 + rest_gap(plate_shape->bounding_radius());
  BodyDefinition body = dynamic_body("plate", plate_shape, {0, 0, z_plate});
  body.friction = 0.8;
  body.restitution = 0;
  const BodyId plate = world.add_body(body);
  const Scalar z_cube = z_plate + 0.1 + rest_gap(cube_shape->bounding_radius());
  std::vector<BodyId> cubes;
  for (int i = 0; i < 81; ++i) {
    body = dynamic_body("cube", cube_shape, {0.11 * (i % 9 - 4), 0.11 * (i / 9 - 4), z_cube});
    body.friction = 0.8;
    body.restitution = 0;
    cubes.push_back(world.add_body(body));
  }
  std::int64_t contacts = 0;
  for (int k = 0; k < 100; ++k) contacts = std::max(contacts, world.advance(0.01).work.contacts);
  EXPECT_GT(contacts, 300);
  const Scalar expected = kGravity * kExcess / 2;
  const Vector3 way = world.state(plate).X_WB.translation() - Vector3(0, 0, z_plate);
  EXPECT_NEAR(way.x(), expected, 1e-3 * expected);
  for (std::size_t i = 0; i < cubes.size(); ++i) {
    const int k = static_cast<int>(i);
    const Vector3 start(0.11 * (k % 9 - 4), 0.11 * (k / 9 - 4), z_cube);
    const Vector3 cube_way = world.state(cubes[i]).X_WB.translation() - start;
    EXPECT_LE((cube_way - way).norm(), 1e-3 * expected);
  }
}

}  // namespace
}  // namespace dyop
