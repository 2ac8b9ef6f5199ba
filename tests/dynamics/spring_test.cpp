// SPDX-License-Identifier: BSD-3-Clause

// Springs and dampers against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/dynamics/joint.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

void run_springs(World& world, int steps, Scalar h) {
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
  }
}

// Two bodies along a direction, joined by a spring between their middles that is stretched.
struct Oscillator {
  Oscillator(const Vector3& direction, Scalar mass_a, Scalar mass_b, Scalar stiffness,
             Scalar damping, Scalar rest_length = 2, Scalar stretch = 0.2)
      : reduced_mass(mass_a * mass_b / (mass_a + mass_b)), axis(direction.normalized()) {
    WorldOptions options;
    options.sleep_steps = 0;
    world = World(options);
    const auto add = [&](Scalar mass, const Vector3& p) {
      BodyDefinition body = dynamic_body("body", std::make_shared<Box>(Vector3(0.2, 0.3, 0.1)), p);
      body.mass_properties.I_BBcm *= mass / body.mass_properties.mass;
      body.mass_properties.mass = mass;
      return world.add_body(body);
    };
    a = add(mass_a, Vector3(1, 2, 3));
    b = add(mass_b, Vector3(1, 2, 3) + (rest_length + stretch) * axis);
    SpringDefinition definition;
    definition.name = "spring";
    definition.a = a;
    definition.b = b;
    definition.rest_length = rest_length;
    definition.stiffness = stiffness;
    definition.damping = damping;
    spring = world.add_spring(definition);
  }
  Scalar length() const {
    return (world.state(b).X_WB.translation() - world.state(a).X_WB.translation()).dot(axis);
  }
  Scalar energy() const { return world.kinetic_energy() + world.spring_energy(); }

  Scalar reduced_mass;
  Vector3 axis;
  World world;
  BodyId a, b;
  SpringId spring;
};

const std::vector<Vector3> kDirections{{1, 0, 0}, {1, 2, -0.5}, {-0.3, 0.2, 1}};
const std::vector<std::pair<Scalar, Scalar>> kMasses{{1, 1}, {1, 100}, {50, 0.5}};

TEST(Spring, OscillatesAtItsFrequencyAndKeepsItsEnergy) {
  for (const Vector3& direction : kDirections) {
    for (const auto& [mass_a, mass_b] : kMasses) {
      constexpr Scalar kFrequency = 5;
      const Scalar reduced = mass_a * mass_b / (mass_a + mass_b);
      Oscillator pair(direction, mass_a, mass_b, kFrequency * kFrequency * reduced, 0);
      const Scalar energy = pair.energy();
      constexpr Scalar kH = 0.005;
      for (int k = 1; k <= 400; ++k) {
        run_springs(pair.world, 1, kH);
        // The midpoint rule's own frequency, 2/h atan(w h / 2), exactly.
        const Scalar own = 2 / kH * std::atan(kFrequency * kH / 2);
        ASSERT_NEAR(pair.length(), 2 + 0.2 * std::cos(own * k * kH), 2e-5);
        ASSERT_NEAR(pair.energy(), energy, 1e-5 * energy);
      }
      // Which is within (w h)^2 / 12 of the true one.
      EXPECT_NEAR(pair.length(), 2 + 0.2 * std::cos(kFrequency * 2), 0.2 * 10 * 6e-5);
      EXPECT_LT(pair.world.momentum().norm(), 1e-9 * (mass_a + mass_b));
      EXPECT_LT(pair.world.state(pair.b).twist.w_WB.norm(), 1e-9);
    }
  }
}

TEST(Spring, DecaysAsItsDamperSays) {
  for (const Vector3& direction : kDirections) {
    for (const auto& [mass_a, mass_b] : kMasses) {
      constexpr Scalar kFrequency = 5;
      constexpr Scalar kDecay = 0.8;
      const Scalar reduced = mass_a * mass_b / (mass_a + mass_b);
      Oscillator pair(direction, mass_a, mass_b, kFrequency * kFrequency * reduced,
                      2 * kDecay * reduced);
      constexpr Scalar kH = 0.005;
      run_springs(pair.world, 400, kH);
      const Scalar damped = std::sqrt(kFrequency * kFrequency - kDecay * kDecay);
      const Scalar t = 2;
      const Scalar expected =
          2 + 0.2 * std::exp(-kDecay * t) *
                  (std::cos(damped * t) + kDecay / damped * std::sin(damped * t));
      EXPECT_NEAR(pair.length(), expected, 0.2 * 1e-3);
    }
  }
}

// Error of the length of a turning, swinging spring after one unit of time, with this many steps.
Scalar turning_length(int steps) {
  Oscillator pair(Vector3(1, 0.4, 0.2), 1, 3, 20, 0.5);
  const Vector3 across = pair.axis.unitOrthogonal();
  MotionState state = pair.world.state(pair.b);
  state.twist.v_WB = 1.5 * across;
  pair.world.set_state(pair.b, state);
  run_springs(pair.world, steps, 1.0 / steps);
  return (pair.world.state(pair.b).X_WB.translation() - pair.world.state(pair.a).X_WB.translation())
      .norm();
}

TEST(Spring, ConvergesAtSecondOrderWhileItTurns) {
  const Scalar exact = turning_length(3200);
  const Scalar coarse = std::abs(turning_length(50) - exact);
  const Scalar fine = std::abs(turning_length(100) - exact);
  EXPECT_LT(fine, 1e-3);
  EXPECT_GT(coarse / fine, 3.4);
  EXPECT_LT(coarse / fine, 4.6);
}

TEST(Spring, KeepsAngularMomentumWhileItTurns) {
  Oscillator pair(Vector3(1, 0.4, 0.2), 1, 3, 20, 0.5);
  MotionState state = pair.world.state(pair.b);
  state.twist.v_WB = Vector3(0.3, -1, 0.7);
  pair.world.set_state(pair.b, state);
  const Vector3 momentum = pair.world.momentum();
  const Vector3 angular = pair.world.angular_momentum();
  run_springs(pair.world, 200, 0.01);
  EXPECT_LT((pair.world.momentum() - momentum).norm(), 1e-10);
  EXPECT_LT((pair.world.angular_momentum() - angular).norm(), 1e-4 * angular.norm());
}

TEST(Spring, DoesNotBlowUpHoweverStiff) {
  for (const Scalar stiffness : {1e4, 1e7, 1e10}) {
    for (const Scalar damping : {0.0, 1e3, 1e6}) {
      Oscillator pair(Vector3(1, 1, 0), 1, 5, stiffness, damping, 1, 0.01);
      MotionState state = pair.world.state(pair.b);
      state.twist.v_WB = Vector3(0, 0, 0.5);
      state.twist.w_WB = Vector3(0, 2, 0);
      pair.world.set_state(pair.b, state);
      const Scalar energy = pair.energy();
      for (int k = 0; k < 200; ++k) {
        run_springs(pair.world, 1, 0.01);
        ASSERT_LT(pair.world.kinetic_energy(), 1.01 * energy) << stiffness << ' ' << damping;
      }
      // Overdamped it relaxes with the time damping / stiffness.
      if (damping > 0 && damping / stiffness < 0.2) {
        EXPECT_LT(pair.world.spring_energy(), 0.01 * energy) << stiffness << ' ' << damping;
      }
    }
  }
}

// A joint that holds the length of a spring, with velocities that the joint must correct.
TEST(Spring, LeavesAJointBesideItAlone) {
  for (const Scalar stiffness : {1.0, 100.0, 1e4, 1e6}) {
    Oscillator pair(Vector3(1, 0.2, 0.1), 1, 3, stiffness, 1, 1.5, 0);
    MotionState state = pair.world.state(pair.b);
    state.twist = {Vector3(1, 0.5, 0), Vector3(1, 2, 3)};
    pair.world.set_state(pair.b, state);
    JointDefinition joint;
    joint.kind = JointKind::Distance;
    joint.a = pair.a;
    joint.b = pair.b;
    pair.world.add_joint(joint);
    const Scalar energy = pair.energy();
    for (int k = 0; k < 100; ++k) {
      run_springs(pair.world, 1, 0.01);
      ASSERT_LT(pair.energy(), energy * (1 + 1e-6)) << stiffness;
    }
    const Vector3 D =
        pair.world.state(pair.b).X_WB.translation() - pair.world.state(pair.a).X_WB.translation();
    EXPECT_NEAR(D.norm(), 1.5, 1e-4);
  }
}

// A ball hung from a kinematic body by a spring of rest length zero.
TEST(Spring, FollowsAKinematicBody) {
  World world(earth_options());
  BodyDefinition hand;
  hand.name = "hand";
  hand.kind = BodyKind::Kinematic;
  hand.shape = std::make_shared<Sphere>(0.1);
  hand.motion = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(0, 0, 5)),
                                                      Twist{{0.5, 0, 0}, Vector3::Zero()});
  const BodyId a = world.add_body(hand);
  const BodyId b = world.add_body(dynamic_body("ball", std::make_shared<Sphere>(0.2), {0, 0, 4}));
  const Scalar mass = world.body(b).mass_properties.mass;
  world.set_pair_enabled(a, b, false);
  SpringDefinition definition;
  definition.a = a;
  definition.b = b;
  definition.rest_length = 0;
  definition.stiffness = 30 * mass;
  definition.damping = 8 * mass;
  world.add_spring(definition);
  run_springs(world, 600, 0.01);
  const MotionState state = world.state(b);
  EXPECT_NEAR(state.X_WB.translation().x(), 3, 1e-4);
  EXPECT_NEAR(state.X_WB.translation().z(), 5 - kGravity / 30, 1e-4);
  EXPECT_NEAR(state.twist.v_WB.x(), 0.5, 1e-4);
}

// A cube pressed on a floor by a stiff spring rests, feels weight and spring, and sleeps; without
// the spring it is awake again.
TEST(Spring, PressesAContactWithoutBlowingUp) {
  World world(earth_options());
  const BodyId floor = world.add_body(floor_body(0.5));
  const BodyId cube = world.add_body(resting_cube(0, 0, 0));
  SpringDefinition definition;
  definition.a = floor;
  definition.b = cube;
  definition.p_AP = Vector3(0, 0, 1);
  definition.p_BQ = Vector3(0, 0, 0.5);
  definition.rest_length = 0.9;
  definition.stiffness = 1e7;
  const SpringId spring = world.add_spring(definition);
  run_springs(world, 200, 0.01);
  const Scalar weight = kGravity * world.body(cube).mass_properties.mass;
  const Scalar z = world.state(cube).X_WB.translation().z();
  EXPECT_NEAR(z, 0.5 + rest_gap(std::sqrt(0.75)), 1e-4);
  const auto contacts = world.contacts();
  ASSERT_EQ(contacts.size(), 1U);
  Scalar impulse = 0;
  for (const PairContact& contact : contacts.front().contacts) impulse += contact.impulse_W.z();
  EXPECT_NEAR(impulse, 0.01 * (weight + 1e7 * (z + 0.5 - 0.9)), 1e-3 * impulse);
  run_springs(world, 100, 0.01);
  EXPECT_TRUE(world.is_asleep(cube));
  world.remove_spring(spring);
  EXPECT_FALSE(world.is_asleep(cube));
}

TEST(Spring, IsPartOfASnapshot) {
  Oscillator pair(Vector3(1, 2, 0), 1, 2, 40, 0.1);
  run_springs(pair.world, 10, 0.01);
  const WorldSnapshot snapshot = pair.world.snapshot();
  run_springs(pair.world, 20, 0.01);
  const Vector3 first = pair.world.state(pair.b).X_WB.translation();
  pair.world.remove_spring(pair.spring);
  pair.world.restore(snapshot);
  EXPECT_EQ(pair.world.spring(pair.spring).stiffness, 40);
  run_springs(pair.world, 20, 0.01);
  EXPECT_EQ(pair.world.state(pair.b).X_WB.translation(), first);
}

TEST(Spring, GoesWithItsBodiesAndRefusesWhatMeansNothing) {
  Oscillator pair(Vector3(1, 0, 0), 1, 1, 1, 0);
  SpringDefinition bad;
  bad.name = "bad";
  bad.a = pair.a;
  bad.b = pair.a;
  EXPECT_EQ(message_of<InvalidArgument>([&] { pair.world.add_spring(bad); }),
            "spring 'bad': it needs two bodies, not 0 twice");
  bad.b = pair.b;
  EXPECT_EQ(message_of<InvalidArgument>([&] { pair.world.add_spring(bad); }),
            "spring 'bad': stiffness or damping must be > 0");
  bad.stiffness = -1;
  EXPECT_EQ(message_of<InvalidArgument>([&] { pair.world.add_spring(bad); }),
            "spring 'bad': stiffness must be finite and >= 0, not -1");
  pair.world.remove_body(pair.a);
  EXPECT_THROW(pair.world.spring(pair.spring), InvalidArgument);
  run_springs(pair.world, 2, 0.01);
}

}  // namespace
}  // namespace dyop
