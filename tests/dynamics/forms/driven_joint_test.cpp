// SPDX-License-Identifier: BSD-3-Clause

// Joints that torques, motors, limits, springs and gravity act on, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/inputs/world_scenes.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kDriveStep = 0.01;

BodyId add_fixed(World& world) {
  BodyDefinition body;
  body.name = "fixed";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Sphere>(0.05);
  return world.add_body(body);
}

// A wheel on a hinge about an axis, with a constant torque about it.
struct Wheel {
  Wheel(const Vector3& axis, Scalar torque, std::optional<JointMotor> motor,
        std::optional<JointLimits> limits)
      : axis_W(axis.normalized()) {
    const BodyId fixed = add_fixed(world);
    const Matrix3 R = rotation_between(Vector3::UnitZ(), axis_W).toRotationMatrix();
    BodyDefinition body =
        dynamic_body("wheel", std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)), {0, 0, 0});
    body.initial.X_WB = RigidPose(R, Vector3::Zero());
    inertia = body.mass_properties.I_BBcm(2, 2);
    id = world.add_body(body);
    set_torque(torque);
    JointDefinition hinge;
    hinge.kind = JointKind::Hinge;
    hinge.a = fixed;
    hinge.b = id;
    hinge.X_AJ = RigidPose(R, Vector3::Zero());
    hinge.motor = motor;
    hinge.limits = limits;
    world.add_joint(hinge);
  }
  void set_torque(Scalar torque) {
    const Vector3 torque_W = torque * axis_W;
    world.set_wrench(id, [torque_W](Scalar, const MotionState&) {
      return Wrench{Vector3::Zero(), torque_W};
    });
  }
  Scalar speed() const { return world.state(id).twist.w_WB.dot(axis_W); }
  Scalar angle() const {
    const Matrix3 R = rotation_between(Vector3::UnitZ(), axis_W).toRotationMatrix().transpose() *
                      world.state(id).X_WB.rotation();
    return std::atan2(R(1, 0), R(0, 0));
  }
  Vector3 axis_W;
  World world;
  BodyId id;
  Scalar inertia = 0;
};

const std::vector<Vector3> kAxes{{0, 0, 1}, {1, -2, 0.5}};

TEST(DrivenJoint, AHingeTurnsWithWhatItsMotorLeavesOfATorque) {
  constexpr Scalar kTorque = 3;
  for (const Vector3& axis : kAxes) {
    for (const Scalar strength : {0.0, 1.0, 2.9}) {
      // A motor that should stand still but is too weak is a brake.
      Wheel wheel(axis, kTorque,
                  strength > 0 ? std::optional(JointMotor{0, strength}) : std::nullopt, {});
      run_solved(wheel.world, 1);
      const Scalar expected = (kTorque - strength) / wheel.inertia;
      EXPECT_NEAR(wheel.speed(), expected, 1e-4 * kTorque / wheel.inertia) << strength;
      EXPECT_NEAR(wheel.world.state(wheel.id).X_WB.translation().norm(), 0, 1e-6);
    }
  }
}

TEST(DrivenJoint, AMotorThatIsStrongEnoughKeepsItsSpeedAgainstATorque) {
  for (const Vector3& axis : kAxes) {
    for (const Scalar torque : {-3.0, 3.0}) {
      Wheel wheel(axis, torque, JointMotor{1.5, 3.1}, {});
      // The time until then: I w / (strength + torque).
      run_solved(wheel.world, 2 + wheel.inertia * 1.5 / 0.1);
      EXPECT_NEAR(wheel.speed(), 1.5, 1e-4) << torque;
    }
  }
}

TEST(DrivenJoint, AHingeStopsAtItsLimitsAndLeavesThem) {
  constexpr Scalar kTorque = 3;
  for (const Vector3& axis : kAxes) {
    Wheel wheel(axis, kTorque, {}, JointLimits{-0.4, 0.6});
    const Scalar rate = kTorque / wheel.inertia;
    run_solved(wheel.world, std::sqrt(2 * 0.6 / rate) + 0.3);
    EXPECT_NEAR(wheel.angle(), 0.6, 1e-4);
    EXPECT_NEAR(wheel.speed(), 0, 1e-4);
    wheel.set_torque(-kTorque);
    const Scalar time = 0.5 * std::sqrt(2 * 1.0 / rate);
    run_solved(wheel.world, time);
    const Scalar run = kDriveStep * std::round(time / kDriveStep);
    EXPECT_NEAR(wheel.speed(), -rate * run, 1e-3 * rate * run);
    EXPECT_NEAR(wheel.angle(), 0.6 - rate * run * run / 2, 1e-3);
    run_solved(wheel.world, std::sqrt(2 * 1.0 / rate) + 0.3);
    EXPECT_NEAR(wheel.angle(), -0.4, 1e-4);
  }
}

// Nothing but the motor moves it, so nothing tells how exactly a joint at rest is to be solved.
TEST(DrivenJoint, AMotorPressesAgainstALimitThatHoldsIt) {
  for (const Vector3& axis : kAxes) {
    Wheel wheel(axis, 0, JointMotor{2, 30}, JointLimits{-0.4, 0.6});
    wheel.world.set_wrench(wheel.id, nullptr);
    run_solved(wheel.world, 2);
    EXPECT_NEAR(wheel.angle(), 0.6, 1e-4);
    EXPECT_NEAR(wheel.speed(), 0, 1e-6);
  }
}

// A block on a vertical slider hangs from a spring; damping = 2 decay m.
struct HungBlock {
  static constexpr Scalar kRate = 5;  // sqrt(stiffness / mass)
  explicit HungBlock(Scalar decay) : world(earth_options()) {
    const BodyId fixed = add_fixed(world);
    BodyDefinition body =
        dynamic_body("block", std::make_shared<Box>(Vector3(0.1, 0.2, 0.3)), {0, 0, -2});
    const Scalar mass = body.mass_properties.mass;
    id = world.add_body(body);
    JointDefinition slider;
    slider.kind = JointKind::Slider;
    slider.a = fixed;
    slider.b = id;
    world.add_joint(slider);
    SpringDefinition spring;
    spring.a = fixed;
    spring.b = id;
    spring.rest_length = 2;
    spring.stiffness = mass * kRate * kRate;
    spring.damping = 2 * decay * mass;
    world.add_spring(spring);
  }
  // Below where the spring is relaxed.
  Scalar hung() const { return -2 - world.state(id).X_WB.translation().z(); }
  World world;
  BodyId id;
};

TEST(DrivenJoint, ABlockOnASliderSwingsOnItsSpringAsDampedAsItIs) {
  constexpr Scalar kRate = HungBlock::kRate;
  constexpr Scalar kSunk = kGravity / (kRate * kRate);  // at rest; it starts at 0
  for (const Scalar decay : {0.0, 0.7, kRate, 2 * kRate}) {
    HungBlock block(decay);
    for (int k = 1; k <= 10; ++k) {
      run_solved(block.world, 0.2, 0.005);
      const Scalar t = 0.2 * k;
      Scalar left = 0;  // of the deflection from where it rests
      if (decay < kRate) {
        const Scalar w = std::sqrt(kRate * kRate - decay * decay);
        left = std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
      } else if (decay == kRate) {
        left = std::exp(-decay * t) * (1 + decay * t);
      } else {
        const Scalar w = std::sqrt(decay * decay - kRate * kRate);
        left = std::exp(-decay * t) * (std::cosh(w * t) + decay / w * std::sinh(w * t));
      }
      EXPECT_NEAR(block.hung(), kSunk * (1 - left), 2e-3 * kSunk)
          << "decay " << decay << ", t " << t;
    }
    EXPECT_LT(block.world.state(block.id).X_WB.translation().head<2>().norm(), 1e-6);
  }
}

// The period of a pendulum of length 1: 2 pi sqrt(1 / g) over the arithmetic-geometric mean of 1
// and cos(angle / 2).
Scalar pendulum_period(Scalar angle) {
  Scalar a = 1;
  Scalar g = std::cos(angle / 2);
  for (int k = 0; k < 8; ++k) {
    const Scalar mean = (a + g) / 2;
    g = std::sqrt(a * g);
    a = mean;
  }
  return 2 * std::numbers::pi / std::sqrt(kGravity) / a;
}

// Period of a ball held at a distance from a point, let go at an angle from straight below.
Scalar measured_period(Scalar angle, Scalar h) {
  World world(earth_options());
  const BodyId fixed = add_fixed(world);
  const BodyId ball = world.add_body(
      dynamic_body("ball", std::make_shared<Sphere>(0.1), {std::sin(angle), 0, -std::cos(angle)}));
  JointDefinition distance;
  distance.kind = JointKind::Distance;
  distance.a = fixed;
  distance.b = ball;
  world.add_joint(distance);
  std::vector<Scalar> crossings;
  Scalar last = std::sin(angle);
  while (crossings.size() < 3 && world.time() < 20) {
    run_solved(world, h, h);
    const Scalar x = world.state(ball).X_WB.translation().x();
    if (last * x < 0) crossings.push_back(world.time() - h * x / (x - last));
    last = x;
  }
  return crossings.size() == 3 ? crossings[2] - crossings[0] : 0;
}

TEST(DrivenJoint, ADistanceIsAPendulumOfAnyAmplitude) {
  for (const Scalar angle : {0.3, 1.5, 2.5}) {
    const Scalar period = pendulum_period(angle);
    EXPECT_NEAR(measured_period(angle, 0.01), period, 4e-3 * period) << angle;
    EXPECT_NEAR(measured_period(angle, 0.0025), period, 4e-4 * period) << angle;
  }
}

}  // namespace
}  // namespace dyop
