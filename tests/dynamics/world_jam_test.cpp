// SPDX-License-Identifier: BSD-3-Clause

// A ball in a wedge whose upper plate comes down. The line between its two contacts makes half the
// wedge's angle with both normals: below the friction angle it is in both cones, no impulses drive
// the ball out, and Coulomb's law has no solution; above it, the ball must escape.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kWedge = 40 * std::numbers::pi / 180;
constexpr Scalar kBallRadius = 0.3;

AdvanceReport close_wedge(World& world, Scalar friction) {
  world.add_body(floor_body(friction));
  BodyDefinition plate;
  plate.name = "plate";
  plate.kind = BodyKind::Kinematic;
  plate.shape = std::make_shared<Box>(Vector3(2, 1, 0.1));
  const Matrix3 R_WB = Eigen::AngleAxisd(-kWedge, Vector3::UnitY()).toRotationMatrix();
  plate.motion = std::make_shared<ConstantTwistMotion>(RigidPose(R_WB, R_WB * Vector3(2.2, 0, 0.1)),
                                                       Twist{Vector3(0, 0, -0.5), Vector3::Zero()});
  plate.friction = friction;
  world.add_body(plate);
  const Scalar x = kBallRadius / std::tan(kWedge / 2) + 0.05;
  BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(kBallRadius),
                                     {x, 0, kBallRadius + rest_gap(kBallRadius)});
  ball.friction = friction;
  world.add_body(ball);
  AdvanceReport report;
  for (int k = 0; k < 20 && report.status != AdvanceStatus::Blocked; ++k) {
    report = world.advance(0.01);
  }
  return report;
}

TEST(WorldJam, ABallEscapesFromAWedgeAboveTheFrictionAngle) {
  World world(earth_options());
  const AdvanceReport report = close_wedge(world, 0.95 * std::tan(kWedge / 2));
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_EQ(report.work.stalls, 0);
}

TEST(WorldJam, ABallIsBlockedInAWedgeBelowTheFrictionAngleAndThatIsFoundSoon) {
  World world(earth_options());
  const AdvanceReport report = close_wedge(world, 1.05 * std::tan(kWedge / 2));
  EXPECT_EQ(report.status, AdvanceStatus::Blocked);
  EXPECT_TRUE(report.too_near.empty());
  EXPECT_LE(report.work.unconverged, 20);  // recorded: 5
}

// A capsule that leans in a slot of which one wall slides, and turns upright until it touches both.
// Its contacts are `kSlotReach` apart along the slot for 1 across it. With more friction than that
// it locks if the wall pulls it upright, though no wall comes nearer.
constexpr Scalar kHalfLength = 0.5;
constexpr Scalar kRodRadius = 0.1;
constexpr Scalar kRodLean = std::numbers::pi / 6;
const Scalar kSlotReach =
    kHalfLength * std::sin(kRodLean) / (kHalfLength * std::cos(kRodLean) + kRodRadius);

struct Slot {
  Slot(Scalar friction, Scalar pull) {
    world.add_body(floor_body(friction));
    const Scalar gap = rest_gap(kHalfLength + kRodRadius);
    const Scalar half_height = kHalfLength * std::cos(kRodLean) + kRodRadius + gap;
    wall.name = "wall";
    wall.kind = BodyKind::Kinematic;
    wall.shape = std::make_shared<Box>(Vector3(5, 1, 0.1));
    wall.motion = std::make_shared<ConstantTwistMotion>(
        RigidPose(Vector3(0, 0, 2 * half_height + 0.1)), Twist{Vector3(pull, 0, 0), {0, 0, 0}});
    wall.friction = friction;
    wall.restitution = 0;
    wall_id = world.add_body(wall);
    BodyDefinition rod = dynamic_body("rod", std::make_shared<Capsule>(kRodRadius, kHalfLength),
                                      {0, 0, 0}, {0, 0, 0}, {0, -0.1, 0});
    rod.initial.X_WB =
        RigidPose(rotation_from_vector(Vector3(0, kRodLean, 0)), {0, 0, half_height});
    rod.friction = friction;
    rod.restitution = 0;
    world.add_body(rod);
  }
  AdvanceReport run() {
    AdvanceReport report;
    for (int k = 0; k < 20 && report.status != AdvanceStatus::Blocked; ++k) {
      report = world.advance(0.01);
      stalls += report.work.stalls;
    }
    return report;
  }
  World world;
  BodyDefinition wall;
  BodyId wall_id;
  std::int64_t stalls = 0;
};

TEST(WorldJam, ARodLocksASlidingWallWithEnoughFriction) {
  Slot slot(1.05 * kSlotReach, -1);
  for (int k = 0; k < 3; ++k) {  // and stays so, without work
    const AdvanceReport report = slot.run();
    EXPECT_EQ(report.status, AdvanceStatus::Blocked);
    EXPECT_EQ(report.offending_pair.first, slot.wall_id);
    EXPECT_LE(report.work.unconverged, 60);  // recorded: 45
  }
  EXPECT_EQ(slot.stalls, 0);
  EXPECT_LT(slot.world.time(), 0.05);
}

TEST(WorldJam, ARodLocksNoWallWithLessFrictionOrIfPulledFlat) {
  for (const auto& [part, pull] : {std::pair(0.95, -1.0), std::pair(1.05, 1.0)}) {
    Slot slot(part * kSlotReach, pull);
    EXPECT_EQ(slot.run().status, AdvanceStatus::Completed) << part << " " << pull;
    EXPECT_EQ(slot.stalls, 0);
  }
}

}  // namespace
}  // namespace dyop
