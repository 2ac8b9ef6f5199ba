// SPDX-License-Identifier: BSD-3-Clause

// A shaft through a trocar: it passes the point, and the hand feels what a minimum of the springs'
// energy over all poses that pass it gives.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::haptic_options;
using testing::kMillisecond;

// A thin rod along z from -60 to 60, through a point 30 above its middle.
HapticScene rod_in_trocar() {
  HapticScene scene;
  scene.tool.push_back({testing::shared_mesh(testing::box_mesh({1, 1, 60})), RigidPose()});
  ToolTrocar trocar;
  trocar.p_W = Vector3(0, 0, 30);
  trocar.axis_T = Vector3(0, 0, 2);
  scene.trocar = trocar;
  return scene;
}

Scalar distance_from_axis(const RigidPose& X_WT, const ToolTrocar& trocar) {
  const Vector3 axis_W = X_WT.rotation() * trocar.axis_T.normalized();
  return (trocar.p_W - X_WT * trocar.p_T).cross(axis_W).norm();
}

// The least energy of the springs over all poses whose axis passes the point: turns by trial, and
// for each the best place along the axis.
struct Rest {
  Scalar energy = kInfinity;
  Vector3 p_W;
};

Rest rest_of(const RigidPose& X_WD, const ToolTrocar& trocar, const CouplingOptions& coupling) {
  const auto at = [&](const Vector3& turn) {
    const Vector3 axis_W =
        rotation_from_vector(turn) * X_WD.rotation() * trocar.axis_T.normalized();
    const Vector3 p_W = trocar.p_W + axis_W * axis_W.dot(X_WD.translation() - trocar.p_W);
    const Scalar stretch = (p_W - X_WD.translation()).squaredNorm();
    return Rest{(coupling.stiffness.x() * stretch +
                 coupling.rotational_stiffness.x() * turn.squaredNorm()) /
                    2,
                p_W};
  };
  Vector3 turn = Vector3::Zero();
  Rest best = at(turn);
  for (Scalar size = 0.5; size > 1e-7; size /= 2) {  // radians
    for (bool is_better = true; is_better;) {
      is_better = false;
      for (int k = 0; k < 6; ++k) {
        const Vector3 tried = turn + (k % 2 == 0 ? size : -size) * Vector3::Unit(k / 2);
        const Rest rest = at(tried);
        if (!(rest.energy < best.energy)) continue;
        best = rest;
        turn = tried;
        is_better = true;
      }
    }
  }
  return best;
}

TEST(ToolTrocar, TheToolRestsWhereTheSpringsHaveLeastEnergy) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  const auto vector = [&] { return Vector3(uniform(random), uniform(random), uniform(random)); };
  const HapticOptions options = haptic_options();
  for (int trial = 0; trial < 8; ++trial) {
    const HapticScene scene = rod_in_trocar();
    HapticSession session(scene, options);
    const Vector3 aside = 8 * vector();
    const Vector3 turn = 0.2 * vector();
    RigidPose X_WD;
    for (int k = 0; k <= 500; ++k) {
      const Scalar part = std::min(1.0, k / 200.0);
      X_WD = RigidPose(rotation_from_vector(part * turn), part * aside);
      const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
      ASSERT_LE(distance_from_axis(tick.tool.X_WT, *scene.trocar), options.rest_offset) << k;
    }
    const HapticTick& tick = session.last();
    EXPECT_EQ(tick.status, HapticStatus::Held);
    EXPECT_LE(distance_from_axis(tick.tool.X_WT, *scene.trocar), 1e-6);
    const Rest rest = rest_of(X_WD, *scene.trocar, options.coupling);
    EXPECT_LE((tick.tool.X_WT.translation() - rest.p_W).norm(), 1e-3);
    // Without other contacts all force on the tool is the trocar's.
    EXPECT_LE((tick.trocar_force_W - tick.wrench.force_W).norm(),
              1e-3 * tick.wrench.force_W.norm());
  }
}

// However far the device is held off the trocar, the tool follows it within some ticks.
TEST(ToolTrocar, TheToolFollowsADeviceHeldOffIt) {
  const HapticScene scene = rod_in_trocar();
  const HapticOptions options = haptic_options();
  HapticSession session(scene, options);
  for (int k = 0; k <= 180; ++k) {
    const RigidPose X_WD(Vector3(0.1 * k, 0, 0));  // 100 mm/s
    const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
    if (k % 30 != 0) continue;
    const Rest rest = rest_of(X_WD, *scene.trocar, options.coupling);
    EXPECT_LE((tick.tool.X_WT.translation() - rest.p_W).norm(), 0.15) << k;
  }
}

TEST(ToolTrocar, ItSlidesAndTurnsAboutItsAxisFreely) {
  HapticSession session(rod_in_trocar(), haptic_options());
  for (int k = 0; k < 300; ++k) {
    const RigidPose X_WD(rotation_from_vector(Vector3(0, 0, 0.01 * k)), Vector3(0, 0, 0.05 * k));
    const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
    EXPECT_LE(tick.wrench.force_W.norm(), 1e-6);
    EXPECT_EQ(tick.status, HapticStatus::Free);
  }
}

// Pressed on a plane through the trocar: what the hand feels is the force of both.
TEST(ToolTrocar, TrocarAndTissueBalanceTheSprings) {
  HapticScene scene = rod_in_trocar();
  scene.obstacles.push_back(testing::deforming_tissue(
      testing::sheet(80, 16).moved(Matrix3::Identity(), {0, 0, -61}), 0.3));
  HapticSession session(scene, haptic_options());
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k <= 400; ++k) {
    const Scalar part = std::min(1.0, k / 300.0);
    const RigidPose X_WD(Vector3(4 * part, 2 * part, -5 * part));
    const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
    sum = tick.trocar_force_W;
    for (const ToolContactPoint& contact : tick.contacts) sum += contact.force_W;
    ASSERT_LE(distance_from_axis(tick.tool.X_WT, *scene.trocar), 0.02) << k;
  }
  const Vector3 felt = session.last().wrench.force_W;
  EXPECT_GT(felt.z(), 3);
  EXPECT_LE((sum - felt).norm(), 0.01 * felt.norm());
}

// A device that jumps and turns by radians.
TEST(ToolTrocar, JumpsLeaveTheAxisAtThePoint) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<Scalar> uniform(-1, 1);
  const HapticScene scene = rod_in_trocar();
  HapticSession session(scene, haptic_options());
  RigidPose X_WD;
  for (int k = 0; k < 600; ++k) {
    if (k % 60 == 0) {
      X_WD = RigidPose(
          rotation_from_vector(2 * Vector3(uniform(random), uniform(random), uniform(random))),
          40 * Vector3(uniform(random), uniform(random), uniform(random)));
    }
    const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
    ASSERT_LE(distance_from_axis(tick.tool.X_WT, *scene.trocar), 0.02) << k;
  }
  HapticScene wrong = rod_in_trocar();
  wrong.trocar->axis_T.setZero();
  EXPECT_THROW(HapticSession(wrong, haptic_options()), InvalidArgument);
}

}  // namespace
}  // namespace dyop
