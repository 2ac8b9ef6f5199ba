// SPDX-License-Identifier: BSD-3-Clause

// Curved contact: a ball that slides or rolls down another keeps its energy to second order in the
// step; a rocking block loses what Housner's formula says; short steps give no energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/inputs/mesh_generators.h"
#include "support/inputs/rolling_scenes.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

// How far the energy of a ball is from its start after 0.4, relative to the kinetic energy gained:
// it starts at the top of a fixed ball with a speed along `azimuth`.
Scalar energy_error_on_a_ball(Scalar h, Scalar friction, Scalar azimuth) {
  constexpr Scalar kRadius = 0.25;
  constexpr Scalar kSpeed = 1.5;
  World world(earth_options());
  BodyDefinition support = floor_body(friction);
  support.shape = std::make_shared<Sphere>(1);
  support.initial.X_WB = RigidPose();
  world.add_body(support);
  const Vector3 along(std::cos(azimuth), std::sin(azimuth), 0);
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(kRadius),
                                     {0, 0, 1 + kRadius + rest_gap(kRadius)}, kSpeed * along);
  if (friction > 0) ball.initial.twist.w_WB = kSpeed / kRadius * Vector3::UnitZ().cross(along);
  ball.friction = friction;
  ball.restitution = 0;
  const BodyId id = world.add_body(ball);
  const Scalar weight = kGravity * ball.mass_properties.mass;
  const Scalar height = world.state(id).X_WB.translation().z();
  const Scalar before = world.kinetic_energy();
  for (int k = 0; k < std::lround(0.4 / h); ++k) world.advance(h);
  const Scalar fallen = height - world.state(id).X_WB.translation().z();
  EXPECT_GT(fallen, 0.1);
  return std::abs(world.kinetic_energy() - before - weight * fallen) / (weight * fallen);
}

TEST(WorldCurved, ABallOffABallKeepsItsEnergyToSecondOrder) {
  for (const Scalar friction : {0.0, 1.0}) {
    for (const Scalar azimuth : {0.0, 0.5, 2.0}) {
      const Scalar coarse = energy_error_on_a_ball(0.01, friction, azimuth);
      const Scalar fine = energy_error_on_a_ball(0.005, friction, azimuth);
      EXPECT_LT(coarse, 5e-3) << friction << ' ' << azimuth;
      EXPECT_GT(coarse, 3.5 * fine) << friction << ' ' << azimuth;
    }
  }
}

// What spins about the normal or turns with its corner on the ground touches at another place at
// the end of each step, and sticks there.
TEST(WorldCurved, WhatRollsSpinsOrPivotsKeepsItsEnergyToSecondOrder) {
  const std::pair<const char*, Scalar> scenes[] = {{"ball", 0.24}, {"capsule", 0.4}, {"rod", 0.3}};
  for (const auto& [scene, end] : scenes) {
    for (const Scalar azimuth : {0.0, 0.6}) {
      const Scalar coarse = rolling_energy_error(scene, 0, azimuth, 0.02, end);
      const Scalar fine = rolling_energy_error(scene, 0, azimuth, 0.01, end);
      EXPECT_LT(fine, 2e-4) << scene << ' ' << azimuth;
      EXPECT_GT(coarse, 3.5 * fine) << scene << ' ' << azimuth;
    }
  }
}

// A child of a compound rolls like the shape itself, on another one too.
TEST(WorldCurved, RoundChildrenOfCompoundsKeepTheirEnergyToSecondOrder) {
  const std::tuple<std::string, int, Scalar> scenes[] = {
      {"ball", 0, 0.24}, {"capsule", 0, 0.4}, {"bowl", 120, 0.1}};
  for (const auto& [scene, facets, end] : scenes) {
    for (const Scalar h : {0.02, 0.01}) {
      const Scalar alone = rolling_energy_error(scene, facets, 0.6, h, end);
      const Scalar child = rolling_energy_error("compound-" + scene, facets, 0.6, h, end);
      EXPECT_LT(child, 1.1 * alone + 1e-5) << scene << ' ' << h;
    }
  }
}

// The spin that a block keeps when it rocks from one lower edge over to the other.
Scalar spin_kept(Scalar h, Scalar half_width, Scalar half_height, Scalar azimuth) {
  World world(earth_options());
  world.add_body(floor_body(2));
  const auto shape = std::make_shared<Box>(Vector3(half_width, 0.5, half_height));
  BodyDefinition block = dynamic_body("block", shape, Vector3::Zero());
  const Scalar tilt = 0.3 * std::atan2(half_width, half_height);
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0, azimuth));
  const Matrix3 R = turn * rotation_from_vector(Vector3(0, tilt, 0));
  const Scalar lowest = half_height * std::cos(tilt) + half_width * std::sin(tilt);
  block.initial.X_WB = RigidPose(R, Vector3(0, 0, lowest + rest_gap(shape->bounding_radius())));
  block.friction = 2;
  block.restitution = 0;
  const BodyId id = world.add_body(block);
  const Vector3 axis = turn.col(1);
  // Its energy above that of the block standing still.
  const Scalar weight = kGravity * block.mass_properties.mass;
  const Scalar standing = weight * (half_height + rest_gap(shape->bounding_radius()));
  Scalar before = 0;
  Scalar after = 0;
  for (int k = 0; k < std::lround(2 / h) && after == 0; ++k) {
    world.advance(h);
    const RigidPose X_WB = world.state(id).X_WB;
    const Scalar lean = axis.dot(turn.col(2).cross(X_WB.rotation().col(2)));  // sine of the tilt
    const Scalar energy = world.kinetic_energy() + weight * X_WB.translation().z() - standing;
    if (lean > 0.01) before = energy;
    if (lean < -0.01) after = energy;
  }
  return std::sqrt(after / before);
}

// To first order in the step: the instant of the landing is found within a step only if it bounces.
TEST(WorldCurved, ARockingBlockKeepsHousnersPartOfItsSpin) {
  constexpr Scalar kExact = 1 - 1.5 / 10;  // three times as high as wide
  for (const Scalar azimuth : {0.0, 0.6}) {
    const Scalar coarse = kExact - spin_kept(0.005, 0.25, 0.75, azimuth);
    const Scalar middle = kExact - spin_kept(0.0025, 0.25, 0.75, azimuth);
    const Scalar fine = kExact - spin_kept(0.00125, 0.25, 0.75, azimuth);
    EXPECT_LT(std::abs(coarse), 0.02) << azimuth;
    EXPECT_LT(std::abs(middle), 0.6 * std::abs(coarse)) << azimuth;
    EXPECT_LT(std::abs(fine), 0.6 * std::abs(middle)) << azimuth;
  }
}

// Links of 400 triangles, each through the one above; the first is fixed.
World hanging_chain(int links) {
  constexpr Scalar kQuarter = std::numbers::pi / 2;
  const auto link = std::make_shared<TriangleMesh>(torus(0.4, 0.1, 20, 10).mesh());
  WorldOptions options = earth_options();
  options.sleep_steps = 0;
  World world(options);
  for (int k = 0; k < links; ++k) {
    BodyDefinition body = dynamic_body("link", link, Vector3(0, 0, -0.55 * k));
    // A little aslant: contacts lie within facets, not on the meshes' planes of symmetry.
    const Matrix3 R = rotation_from_vector(Vector3(kQuarter, 0, 0));
    const Matrix3 turn = rotation_from_vector(Vector3(0, 0, kQuarter * k + 0.03));
    body.initial.X_WB = RigidPose(turn * R, body.initial.X_WB.translation());
    body.restitution = 0;
    body.friction = 0;
    if (k == 0) body.kind = BodyKind::Static;
    world.add_body(body);
  }
  return world;
}

// However short a step is: its contacts may lie on other facets at its end, nearer than
// extrapolated by what has nothing to do with its length, and recover their gaps.
TEST(WorldCurved, ShortStepsGiveHangingLinksNoEnergy) {
  World world = hanging_chain(4);
  for (int k = 0; k < 80; ++k) world.advance(0.01);
  Scalar usual = 0;  // the links jitter, and one instant tells little
  for (int k = 0; k < 20; ++k) {
    world.advance(0.01);
    usual = std::max(usual, world.kinetic_energy());
  }
  const WorldSnapshot begin = world.snapshot();
  for (const Scalar h : {1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-13}) {
    world.restore(begin);
    Scalar largest = 0;
    for (int k = 0; k < 50; ++k) {
      EXPECT_EQ(world.advance(h).status, AdvanceStatus::Completed) << h;
      largest = std::max(largest, world.kinetic_energy());
    }
    EXPECT_LT(largest, 1.1 * usual) << h;
    EXPECT_EQ(world.advance(0.01).status, AdvanceStatus::Completed) << h;
    EXPECT_LT(world.kinetic_energy(), 1.1 * usual) << h;
  }
}

}  // namespace
}  // namespace dyop
