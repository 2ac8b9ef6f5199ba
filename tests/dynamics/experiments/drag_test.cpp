// SPDX-License-Identifier: BSD-3-Clause

// Bodies on a floor under wrenches that depend on their velocity.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kDrag = 2;  // of the acceleration, 1 / s
constexpr Scalar kStartSpeed = 3;
constexpr Scalar kStartSpin = 5;

// A cube of side 1 that slides along x, and turns about z, on a floor for one unit of time.
MotionState slid(Scalar friction, Scalar spin, Scalar h, Scalar duration,
                 const std::function<Wrench(const Twist&)>& per_mass) {
  World world(earth_options());
  world.add_body(floor_body(friction));
  BodyDefinition cube = resting_cube(0, 0, 0);
  cube.friction = friction;
  cube.initial.twist = {Vector3(kStartSpeed, 0, 0), Vector3(0, 0, spin)};
  const Scalar mass = cube.mass_properties.mass;
  cube.wrench = [=](Scalar, const MotionState& state) {
    const Wrench wrench = per_mass(state.twist);
    return Wrench{mass * wrench.force, mass / 6 * wrench.torque};  // m a^2 / 6
  };
  const BodyId id = world.add_body(cube);
  for (int k = 0; k < int(std::lround(duration / h)); ++k) world.advance(h);
  return world.state(id);
}

Wrench linear_drag(Scalar rate, const Twist& twist) {
  return {-rate * twist.v_WB, -rate * twist.w_WB};
}

TEST(Drag, SlowsASlidingAndASpinningCubeAtSecondOrder) {
  const auto error = [](Scalar h) {
    const auto drag = [](const Twist& twist) { return linear_drag(kDrag, twist); };
    const Twist twist = slid(0, kStartSpin, h, 1, drag).twist;
    return Vector2(twist.v_WB.x() - kStartSpeed * std::exp(-kDrag),
                   twist.w_WB.z() - kStartSpin * std::exp(-kDrag));
  };
  const Vector2 coarse = error(0.02);
  const Vector2 fine = error(0.01);
  EXPECT_LT(coarse.cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT(fine.cwiseAbs().maxCoeff(), 0.3 * coarse.cwiseAbs().maxCoeff());
}

TEST(Drag, AddsToFriction) {
  const Scalar friction = 0.3;
  const auto drag = [](const Twist& twist) { return linear_drag(kDrag, twist); };
  const Scalar terminal = friction * kGravity / kDrag;  // v' = -friction g - drag v
  const Scalar exact = (kStartSpeed + terminal) * std::exp(-kDrag * 0.4) - terminal;
  const Twist twist = slid(friction, 0, 0.01, 0.4, drag).twist;
  EXPECT_NEAR(twist.v_WB.x(), exact, 1e-4);
}

// A force across the velocity does no work.
TEST(Drag, AForceAcrossTheVelocityOnlyTurnsIt) {
  const Scalar rate = 5;
  const auto magnet = [&](const Twist& twist) {
    return Wrench{rate * twist.v_WB.cross(Vector3::UnitZ()), Vector3::Zero()};
  };
  const Vector3 v = slid(0, 0, 0.01, 1, magnet).twist.v_WB;
  EXPECT_NEAR(v.head<2>().norm(), kStartSpeed, 1e-6);
  EXPECT_NEAR(std::remainder(std::atan2(v.y(), v.x()) + rate, 2 * std::numbers::pi), 0, 1e-3);
}

// Much stiffer than the step: the speed falls all the same, and never changes sign.
TEST(Drag, HoldsWhereItIsStiff) {
  for (const Scalar rate : {50., 200., 1000., 10000.}) {
    const auto drag = [&](const Twist& twist) { return linear_drag(rate, twist); };
    for (const Scalar duration : {0.01, 0.1}) {
      const Scalar v = slid(0, 0, 0.01, duration, drag).twist.v_WB.x();
      EXPECT_LE(std::abs(v), 0.7 * kStartSpeed) << rate;
      EXPECT_LE(std::abs(v - kStartSpeed * std::exp(-rate * duration)), 0.2) << rate;
    }
  }
}

}  // namespace
}  // namespace dyop
