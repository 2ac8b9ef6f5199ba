// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/soft_region.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

constexpr Scalar kTool = 2, kRegion = 5, kMargin = 1, kStiffness = 0.5;
constexpr Scalar kTouch = kTool + kRegion + kMargin;

// A ball at a height over a ball that pushes back, at the origin.
HapticScene over_region(Scalar height, bool deforms = false) {
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Sphere>(kTool), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, height));
  ToolObstacle region = deforms ? testing::deforming_tissue(testing::icosphere(4, kRegion))
                                : testing::rigid_tissue(std::make_shared<Sphere>(kRegion));
  region.role = ObstacleRole::SoftRegion;
  region.margin = kMargin;
  region.soft_stiffness = kStiffness;
  scene.obstacles.push_back(region);
  return scene;
}

Scalar force_up(const HapticSession& session) {
  return session.last().wrench.force_W.z();
}

// Through the margin, the surface, the middle and out of the far side, and back again.
TEST(SoftRegion, PushesInProportionToTheDepthAllTheWayThrough) {
  for (const bool deforms : {false, true}) {
    HapticSession session(over_region(kTouch + 1, deforms), haptic_options());
    const Scalar error = kStiffness * (deforms ? 0.05 : 0.03);
    Scalar last = 0;
    for (int k = 0; k <= 800; ++k) {
      const Scalar height = kTouch + 1 - 0.05 * (k <= 400 ? k : 800 - k);
      session.update(device_at({0, 0, height}), kMillisecond);
      EXPECT_EQ(session.last().status, HapticStatus::Free) << k;
      EXPECT_NEAR(force_up(session), kStiffness * std::max(0.0, kTouch - height), error) << k;
      EXPECT_LE(std::abs(force_up(session) - last), 1.2 * kStiffness * 0.05) << k;
      last = force_up(session);
    }
    EXPECT_NEAR(last, 0, 1e-9);
  }
}

// Around it the force turns with the nearest direction, and changes by what the tool moves.
TEST(SoftRegion, TurnsWithTheSurfaceWithoutAStep) {
  HapticSession session(over_region(kTouch + 1), haptic_options());
  for (int k = 0; k <= 60; ++k) session.update(device_at({0, 0, kTouch + 1 - 0.05 * k}), 1e-3);
  const Scalar radius = kTouch - 2;
  Vector3 last = session.last().wrench.force_W;
  for (int k = 1; k <= 300; ++k) {
    const Scalar angle = 0.01 * k;
    const Vector3 outward(std::sin(angle), 0, std::cos(angle));
    const HapticTick& tick = session.update(device_at(radius * outward), kMillisecond);
    EXPECT_LE((tick.wrench.force_W - last).norm(), 2 * kStiffness * radius * 0.01) << k;
    EXPECT_NEAR(tick.wrench.force_W.dot(outward), kStiffness * 2, 0.05) << k;
    last = tick.wrench.force_W;
  }
}

TEST(SoftRegion, IsLimitedWithTheSprings) {
  HapticOptions options = haptic_options();
  options.coupling.largest_force = 1.5;
  HapticSession session(over_region(kTouch + 1), options);
  for (int k = 0; k <= 160; ++k) {
    session.update(device_at({0, 0, kTouch + 1 - 0.05 * k}), kMillisecond);
    EXPECT_LE(session.last().wrench.force_W.norm(), 1.5 * (1 + 1e-12));
  }
  EXPECT_NEAR(force_up(session), 1.5, 1e-9);
}

// Sum of force times displacement, counted here.
TEST(SoftRegion, ItsWorkIsEnergyReturned) {
  HapticSession session(over_region(kTouch + 1), haptic_options());
  Scalar work = 0;
  Vector3 last = Vector3(0, 0, kTouch + 1), force = Vector3::Zero();
  for (int k = 0; k <= 100; ++k) {
    const Vector3 p(0, 0, kTouch + 1 - 0.2 * std::min(k, 100 - k));
    work += force.dot(p - last);
    force = session.update(device_at(p), kMillisecond).wrench.force_W;
    last = p;
    EXPECT_NEAR(session.last().energy_returned, work, 1e-9) << k;
  }
  EXPECT_GT(work, 0.5);
}

// A tool that tissue holds at one place while the device is at another: a ball, so about its centre
// the region's pull has no torque.
TEST(SoftRegion, ItsTorqueIsAboutTheDevice) {
  HapticScene scene = over_region(kTouch - 1.5);
  ToolObstacle wall = testing::rigid_tissue(std::make_shared<Box>(Vector3(1, 50, 50)),
                                            RigidPose(Vector3(kTool + 1.5, 0, 0)));
  scene.obstacles.push_back(wall);
  HapticSession session(scene, haptic_options());
  for (int k = 0; k <= 200; ++k) {
    session.update(device_at({0.02 * k, 0, kTouch - 1.5}), kMillisecond);
  }
  const HapticTick& tick = session.last();
  const Vector3 lever = tick.tool.X_WT.translation() - Vector3(4, 0, kTouch - 1.5);
  ASSERT_LT(lever.x(), -3);
  const Vector3 soft = tick.wrench.force_W - lever;
  ASSERT_GT(soft.z(), 0.5);
  const Vector3 turn = rotation_vector(tick.tool.X_WT.rotation());
  EXPECT_TRUE((tick.wrench.torque_W - 200 * turn - lever.cross(soft)).isZero(0.02));
}

// The end of a long shaft that enters the region feels the depth there, not that at its origin.
TEST(SoftRegion, AnEndOfALongToolFeelsItsOwnDepth) {
  HapticScene scene;
  const Scalar half = 60;
  scene.tool.push_back(
      {std::make_shared<Box>(Vector3(half, 1, 1)), RigidPose(Vector3(half, 0, 0))});
  scene.X_WT = RigidPose(Vector3(-2 * half + 1, 0, 1.2 + kRegion + kMargin));
  ToolObstacle region = testing::rigid_tissue(std::make_shared<Sphere>(kRegion));
  region.role = ObstacleRole::SoftRegion;
  region.margin = kMargin;
  region.soft_stiffness = kStiffness;
  scene.obstacles.push_back(region);
  HapticSession session(scene, haptic_options());
  const Vector3 start = scene.X_WT.translation();
  for (int k = 0; k <= 100; ++k) {
    session.update(device_at(start - Vector3(0, 0, 0.02 * k)), kMillisecond);
  }
  const Scalar depth = 1.8;
  EXPECT_NEAR(force_up(session), kStiffness * depth, 0.03 * kStiffness * depth);
  // The middle of the contact is near the shaft's end.
  const Scalar lever = -session.last().wrench.torque_W.y() / force_up(session);
  EXPECT_GT(lever, 2 * half - 4);
  EXPECT_LT(lever, 2 * half + 1);
}

// Within the margin; or inside, where the proxy leaves along an axis or a diagonal of the world and
// then slides to the nearest place.
TEST(SoftRegion, AToolThatStartsInsideIsPushedGently) {
  for (const Scalar depth : {0.8, 2.0}) {
    HapticSession session(over_region(kTouch - depth), haptic_options());
    Vector3 last = Vector3::Zero();
    for (int k = 0; k <= 200; ++k) {
      session.update(device_at({0, 0, kTouch - depth}), kMillisecond);
      const Vector3 force = session.last().wrench.force_W;
      const Scalar most = depth < kMargin ? 1.1 * 50 * kMillisecond : 0.5;
      EXPECT_LE((force - last).norm(), kStiffness * most) << k;
      last = force;
    }
    EXPECT_NEAR(last.z(), kStiffness * depth, 0.05);
  }
}

// A region that moves over a tool at rest, by snapshots.
TEST(SoftRegion, ThatDeformsPushesByWhereItIs) {
  const HapticScene scene = over_region(kTouch + 0.5, true);
  HapticSession session(scene, haptic_options());
  std::vector<Vector3> vertices = scene.obstacles[0].vertices;
  Scalar last = 0;
  for (int k = 0; k < 600; ++k) {
    if (k % 20 == 0) {
      for (Vector3& p : vertices) p.z() += k < 300 ? 0.2 : 0;
      EXPECT_TRUE(session.give_snapshot(0, vertices, 0.02)) << k;
    }
    session.update(device_at({0, 0, kTouch + 0.5}), kMillisecond);
    EXPECT_EQ(session.last().tissue_lag, 0) << k;
    EXPECT_LE(std::abs(force_up(session) - last), 0.02) << k;
    last = force_up(session);
  }
  EXPECT_NEAR(last, kStiffness * (15 * 0.2 - 0.5), 0.05);
}

}  // namespace
}  // namespace dyop
