// SPDX-License-Identifier: BSD-3-Clause

// Friction that slows a turn, against closed forms: of the points a body spins on, torsional and
// rolling friction.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "support/inputs/curved_meshes.h"
#include "support/inputs/world_scenes.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kTurnStep = 0.01;

BodyDefinition lying(const std::shared_ptr<const Shape>& shape, Scalar height, const Matrix3& R,
                     const Twist& twist) {
  BodyDefinition body = dynamic_body("body", shape, {0, 0, 0}, twist.v_WB, twist.w_WB);
  body.initial.X_WB = RigidPose(R, Vector3(0, 0, height + rest_gap(shape->bounding_radius())));
  body.restitution = 0;
  return body;
}

// Spins about z on points at a distance `lever` from its axis, all of which bear the same weight:
// (mu lever + tau) m g slows it by a constant rate until it stands, without going anywhere.
void expect_spinning(const std::shared_ptr<const Shape>& shape, Scalar height, const Matrix3& R,
                     Scalar lever, Scalar torsional) {
  constexpr Scalar kFriction = 0.3;
  constexpr Scalar kSpin = 6;
  World world(earth_options());
  world.add_body(floor_body(kFriction));
  BodyDefinition body = lying(shape, height, R, {Vector3::Zero(), {0, 0, kSpin}});
  body.friction = kFriction;
  body.torsional_friction = torsional;
  const BodyId id = world.add_body(body);
  const Scalar inertia = (R * body.mass_properties.I_BBcm * R.transpose())(2, 2);
  const Scalar torque = (kFriction * lever + torsional) * body.mass_properties.mass * kGravity;
  const Scalar slowing = torque / inertia;
  const Scalar half = std::floor(kSpin / slowing / 2 / kTurnStep) * kTurnStep;
  run_for(world, half);
  EXPECT_NEAR(world.state(id).twist.w_WB.z(), kSpin - slowing * half, 1e-3 * kSpin);
  run_for(world, half + 0.1);
  const MotionState state = world.state(id);
  EXPECT_LT(state.twist.w_WB.norm(), 1e-6);
  const Scalar angle = kSpin * kSpin / (2 * slowing);
  const Vector3 x_W = state.X_WB.rotation() * R.transpose() * Vector3::UnitX();
  EXPECT_NEAR(std::remainder(std::atan2(x_W.y(), x_W.x()) - angle, 2 * std::numbers::pi), 0,
              2e-3 * angle);
  EXPECT_LT(state.X_WB.translation().head<2>().norm(), 1e-4 * lever);
}

TEST(FrictionTorque, StopsBoxAndPlateThatSpinOnTheirCorners) {
  for (const Vector3& half : {Vector3(0.5, 0.5, 0.5), Vector3(0.4, 0.3, 0.02)}) {
    const auto box = std::make_shared<Box>(half);
    for (const Scalar torsional : {0.0, 0.1}) {
      expect_spinning(box, half.z(), Matrix3::Identity(), half.head<2>().norm(), torsional);
    }
  }
}

TEST(FrictionTorque, StopsADiscThatSpinsOnItsRim) {
  const MeshArrays arrays = disc(0.5, 0.1, 64);
  const auto mesh = std::make_shared<TriangleMesh>(arrays.vertices, arrays.triangles);
  const Matrix3 R = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));
  for (const Scalar torsional : {0.0, 0.1}) expect_spinning(mesh, 0.1, R, 0.5, torsional);
}

// The torque rho m g slows rolling by rho g / (r (1 + I / (m r^2))).
TEST(FrictionTorque, StopsARollingCapsuleByRollingFriction) {
  constexpr Scalar kRadius = 0.3;
  constexpr Scalar kRolling = 0.02;
  constexpr Scalar kSpeed = 1;
  for (const Scalar turn : {0.0, 0.4}) {  // of the direction it rolls in
    World world(earth_options());
    world.add_body(floor_body(0.5));
    const auto capsule = std::make_shared<Capsule>(kRadius, 0.6);
    const Matrix3 heading = rotation_from_vector(Vector3(0, 0, turn));
    const Matrix3 R = heading * rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));
    BodyDefinition body =
        lying(capsule, kRadius, R,
              {heading * Vector3(kSpeed, 0, 0), heading * Vector3(0, kSpeed / kRadius, 0)});
    body.rolling_friction = kRolling;
    const BodyId id = world.add_body(body);
    const Scalar inertia = body.mass_properties.I_BBcm(0, 0);
    const Scalar axial = body.mass_properties.I_BBcm(2, 2);
    ASSERT_LT(axial, inertia);  // its axis is z
    const Scalar ratio = axial / (body.mass_properties.mass * kRadius * kRadius);
    const Scalar slowing = kRolling * kGravity / (kRadius * (1 + ratio));
    run_for(world, 1);
    const Vector3 v = heading.transpose() * world.state(id).twist.v_WB;
    EXPECT_NEAR(v.x(), kSpeed - slowing, 5e-3 * slowing) << turn;
    run_for(world, 2);
    const Vector3 way = heading.transpose() * world.state(id).X_WB.translation();
    EXPECT_NEAR(way.x(), kSpeed * kSpeed / (2 * slowing), 5e-3) << turn;
    EXPECT_NEAR(way.y(), 0, 1e-3) << turn;
    EXPECT_LT(world.state(id).twist.v_WB.norm(), 1e-6) << turn;
  }
}

}  // namespace
}  // namespace dyop
