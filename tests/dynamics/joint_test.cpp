// SPDX-License-Identifier: BSD-3-Clause

// Joints against closed forms, at steps of 0.01.
#include "dyop/dynamics/joint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/capsule.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

constexpr Scalar kJointStep = 0.01;

BodyDefinition anchor_body() {
  BodyDefinition body;
  body.name = "anchor";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Sphere>(0.05);
  return body;
}

void run_joints(World& world, Scalar time) {
  const int steps = static_cast<int>(std::lround(time / kJointStep));
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(kJointStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
  }
}

// A ball that hangs one below the origin, deflected by an angle.
struct Pendulum {
  explicit Pendulum(Scalar angle, JointKind kind = JointKind::Ball) : world(earth_options()) {
    const BodyId anchor = world.add_body(anchor_body());
    const Matrix3 R = rotation_from_vector(Vector3(0, -angle, 0));
    BodyDefinition body = dynamic_body("bob", std::make_shared<Sphere>(0.2), {0, 0, 0});
    body.initial.X_WB = RigidPose(R, R * Vector3(0, 0, -1));
    mass_properties = body.mass_properties;
    bob = world.add_body(body);
    JointDefinition definition;
    definition.name = "pivot";
    definition.kind = kind;
    definition.a = anchor;
    definition.b = bob;
    const Matrix3 z_to_y = rotation_from_vector(Vector3(-std::numbers::pi / 2, 0, 0));
    definition.X_AJ = RigidPose(z_to_y, Vector3::Zero());  // turns about y
    definition.X_BJ = RigidPose(z_to_y, Vector3(0, 0, 1));
    joint = world.add_joint(definition);
  }
  Scalar energy() const {
    return world.kinetic_energy() +
           mass_properties.mass * kGravity * world.state(bob).X_WB.translation().z();
  }
  Scalar period() const {
    const Scalar inertia = mass_properties.I_BBcm(0, 0) + mass_properties.mass;
    return 2 * std::numbers::pi * std::sqrt(inertia / (mass_properties.mass * kGravity));
  }
  World world;
  MassProperties mass_properties;
  BodyId bob;
  JointId joint;
};

TEST(Joint, SwingsAPendulumWithItsPeriodAndEnergy) {
  for (const JointKind kind : {JointKind::Ball, JointKind::Hinge}) {
    Pendulum pendulum(0.05, kind);
    const Scalar energy = pendulum.energy();
    const Scalar swing = pendulum.mass_properties.mass * kGravity * (1 - std::cos(0.05));
    Scalar last = pendulum.world.state(pendulum.bob).X_WB.translation().x();
    std::vector<Scalar> crossings;
    for (int k = 0; k < 500; ++k) {
      run_joints(pendulum.world, kJointStep);
      const Scalar x = pendulum.world.state(pendulum.bob).X_WB.translation().x();
      if (last * x < 0) crossings.push_back(pendulum.world.time() - kJointStep * x / (x - last));
      last = x;
      EXPECT_NEAR(pendulum.world.state(pendulum.bob).X_WB.translation().norm(), 1, 1e-4);
    }
    ASSERT_GE(crossings.size(), 4U);
    const Scalar half = (crossings.back() - crossings.front()) / Scalar(crossings.size() - 1);
    EXPECT_NEAR(2 * half, pendulum.period(), 2e-3 * pendulum.period());
    EXPECT_NEAR(pendulum.energy() - energy, 0, 0.02 * swing);
  }
}

TEST(Joint, LosesEnergyAtSecondOrderOnly) {
  const auto drift = [](Scalar h) {
    Pendulum pendulum(1.5);
    const Scalar before = pendulum.energy();
    for (int k = 0; k < int(2 / h); ++k) pendulum.world.advance(h);
    return std::abs(pendulum.energy() - before);
  };
  EXPECT_LT(drift(0.005), 0.5 * drift(0.01) + 1e-6 * 33 * kGravity);
}

TEST(Joint, TurnsAHingeAtTheSpeedOfItsMotor) {
  World world;
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId wheel = world.add_body(
      dynamic_body("wheel", std::make_shared<Box>(Vector3(0.3, 0.3, 0.1)), {0, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Hinge;
  definition.a = anchor;
  definition.b = wheel;
  definition.motor = JointMotor{2, 50};
  const JointId joint = world.add_joint(definition);
  constexpr Scalar kSolved = 2e-5;  // literal: the tolerance of the solver in this world
  // Until it has its speed the torque is the motor's strength.
  const Scalar inertia = world.body(wheel).mass_properties.I_BBcm(2, 2);
  run_joints(world, 0.05);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), 0.05 * 50 / inertia, 0.02 * 0.05 * 50 / inertia);
  run_joints(world, 1);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), 2, kSolved);
  world.set_motor(joint, JointMotor{-1, 50});
  run_joints(world, 1);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), -1, kSolved);
}

TEST(Joint, StopsASliderAtItsLimit) {
  World world(earth_options());
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId block = world.add_body(
      dynamic_body("block", std::make_shared<Box>(Vector3(0.1, 0.2, 0.3)), {0, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Slider;
  definition.a = anchor;
  definition.b = block;
  definition.limits = JointLimits{-0.5, 0.5};
  world.add_joint(definition);
  run_joints(world, 1);
  const MotionState state = world.state(block);
  EXPECT_NEAR(state.X_WB.translation().z(), -0.5, 1e-4);
  EXPECT_LT(state.X_WB.translation().head<2>().norm(), 1e-6);
  EXPECT_NEAR(state.X_WB.rotation().trace(), 3, 1e-9);
  EXPECT_NEAR(state.twist.v_WB.z(), 0, 1e-4);
}

TEST(Joint, HoldsFixedBodiesTogetherAndLetsThemGo) {
  World world(earth_options());
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId arm = world.add_body(
      dynamic_body("arm", std::make_shared<Box>(Vector3(0.5, 0.1, 0.1)), {0.6, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Fixed;
  definition.a = anchor;
  definition.b = arm;
  definition.X_BJ = RigidPose(Vector3(-0.6, 0, 0));
  const JointId joint = world.add_joint(definition);
  run_joints(world, 1);
  EXPECT_LT((world.state(arm).X_WB.translation() - Vector3(0.6, 0, 0)).norm(), 1e-4);
  world.remove_joint(joint);
  run_joints(world, 0.5);
  EXPECT_NEAR(world.state(arm).twist.v_WB.z(), -kGravity * 0.5, 1e-2);
  EXPECT_NE(message_of([&] { world.joint(joint); }).find("no joint"), std::string::npos);
}

TEST(Joint, KeepsADistance) {
  World world;
  const BodyId a =
      world.add_body(dynamic_body("a", std::make_shared<Sphere>(0.1), {0, 0, 0}, {0, 1, 0}));
  const BodyId b =
      world.add_body(dynamic_body("b", std::make_shared<Sphere>(0.1), {1, 0, 0}, {0, -1, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Distance;
  definition.a = a;
  definition.b = b;
  world.add_joint(definition);
  const Vector3 spin = world.angular_momentum();
  const Scalar energy = world.kinetic_energy();
  run_joints(world, 3);
  const Vector3 between = world.state(b).X_WB.translation() - world.state(a).X_WB.translation();
  EXPECT_NEAR(between.norm(), 1, 1e-5);
  EXPECT_LT(world.momentum().norm(), 1e-9);
  EXPECT_NEAR((world.angular_momentum() - spin).norm(), 0, 1e-3 * spin.norm());
  EXPECT_NEAR(world.kinetic_energy(), energy, 1e-3 * energy);
}

// However far it goes in a step: a bound on the speed with which errors of position are closed must
// not bound what the turn needs, or the joint tears open, and a spring in parallel gains energy.
TEST(Joint, KeepsADistanceToABodyThatCirclesFast) {
  for (const Scalar way : {0.05, 0.25, 0.8, 3.0}) {  // in a step; the distance is 1
    World world;
    const BodyId anchor = world.add_body(anchor_body());
    const BodyId ball = world.add_body(
        dynamic_body("ball", std::make_shared<Sphere>(0.1), {1, 0, 0}, {0, way / kJointStep, 0}));
    JointDefinition definition;
    definition.kind = JointKind::Distance;
    definition.a = anchor;
    definition.b = ball;
    world.add_joint(definition);
    const Scalar energy = world.kinetic_energy();
    for (int k = 0; k < 100; ++k) {
      run_joints(world, kJointStep);
      EXPECT_NEAR(world.state(ball).X_WB.translation().norm(), 1, 3e-4) << "way " << way;
      EXPECT_NEAR(world.kinetic_energy(), energy, 1e-4 * energy) << "way " << way;
    }
  }
}

// A trunk, a head, two arms and two legs of capsules; returns its mass.
Scalar add_ragdoll(World& world, const RigidPose& X_WR) {
  const Quaternion across = Quaternion::FromTwoVectors(Vector3::UnitZ(), Vector3::UnitX());
  const Quaternion upright = Quaternion::Identity();
  Scalar mass = 0;
  const auto add = [&](Scalar radius, Scalar half_length, const RigidPose& X_RB) {
    BodyDefinition body =
        dynamic_body("limb", std::make_shared<Capsule>(radius, half_length), Vector3::Zero());
    body.initial.X_WB = X_WR * X_RB;
    body.restitution = 0;
    mass += body.mass_properties.mass;
    return world.add_body(body);
  };
  const BodyId trunk = add(0.15, 0.25, RigidPose());
  const auto add_limb = [&](Scalar radius, Scalar half_length, const RigidPose& X_RB,
                            const Vector3& p_R) {
    JointDefinition joint;
    joint.a = trunk;
    joint.b = add(radius, half_length, X_RB);
    joint.X_AJ = RigidPose(p_R);
    joint.X_BJ = X_RB.inverse() * RigidPose(p_R);
    world.add_joint(joint);
  };
  add_limb(0.12, 0.05, RigidPose(upright, {0, 0, 0.62}), {0, 0, 0.42});
  for (const Scalar side : {-1.0, 1.0}) {
    add_limb(0.07, 0.25, RigidPose(across, {side * 0.56, 0, 0.25}), {side * 0.2, 0, 0.25});
    add_limb(0.09, 0.35, RigidPose(upright, {side * 0.12, 0, -0.9}), {side * 0.12, 0, -0.42});
  }
  return mass;
}

// Ragdolls that begin inside each other have no way apart that their joints allow: pushing them
// apart gives no energy, and no step tries for long.
TEST(Joint, EndsTheStepAndGainsNoEnergyWhereHeldBodiesBeginInsideEachOther) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  Scalar mass = 0;
  const Matrix3 lying = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));
  for (int i = 0; i < 9; ++i) {
    const Vector3 p(0, 1.2 * (i % 3), 0.35 + i / 3);
    mass += add_ragdoll(world, RigidPose(lying, p));
  }
  std::size_t too_near = 0;
  for (int k = 1; k <= 3; ++k) {
    const AdvanceReport report = world.advance(kJointStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_LT(report.work.unconverged, 100);
    const Scalar speed = kGravity * k * kJointStep;
    EXPECT_LT(world.kinetic_energy(), 2 * mass * speed * speed);
    too_near += report.too_near.size();
  }
  EXPECT_GT(too_near, 0U);
}

TEST(Joint, RefusesWhatCannotBe) {
  World world;
  const BodyId a = world.add_body(anchor_body());
  const BodyId b = world.add_body(anchor_body());
  JointDefinition definition;
  definition.name = "knee";
  definition.a = a;
  definition.b = a;
  const auto message = [&] { return message_of([&] { world.add_joint(definition); }); };
  EXPECT_NE(message().find("joint 'knee': needs two different bodies"), std::string::npos);
  definition.b = b;
  EXPECT_NE(message().find("one of its bodies must be dynamic"), std::string::npos);
  definition.motor = JointMotor{1, 1};
  EXPECT_NE(message().find("can have a motor"), std::string::npos);
  definition.kind = JointKind::Hinge;
  definition.limits = JointLimits{1, -1};
  EXPECT_NE(message().find("in order"), std::string::npos);
}

}  // namespace
}  // namespace dyop
