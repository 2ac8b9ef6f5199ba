// SPDX-License-Identifier: BSD-3-Clause

// A ball in a wedge whose upper plate comes down. The line between its two contacts makes half the
// wedge's angle with both normals: below the friction angle it is in both cones, no impulses drive
// the ball out, and Coulomb's law has no solution; above it, the ball must escape.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "dyop/motion/constant_twist_motion.h"
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

}  // namespace
}  // namespace dyop
