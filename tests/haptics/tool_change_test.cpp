// SPDX-License-Identifier: BSD-3-Clause

// What a builder changes while a session runs: springs, and where the tool is.

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

HapticScene ball_over_plane() {
  HapticScene scene = testing::ball_tool(2, {0.3, 0.2, 4});
  scene.obstacles.push_back(testing::rigid_tissue(testing::shared_mesh(testing::sheet(40, 8))));
  return scene;
}

CouplingOptions with_stiffness(Scalar stiffness) {
  CouplingOptions coupling = haptic_options().coupling;
  coupling.stiffness.setConstant(stiffness);
  return coupling;
}

void go(HapticSession& session, Scalar from, Scalar to, int ticks) {
  for (int k = 1; k <= ticks; ++k) {
    session.update(device_at({0.3, 0.2, from + (to - from) * k / ticks}), kMillisecond);
  }
}

TEST(ToolChange, SofterSpringsActAtOnceAndStifferOnesWhenTheToolIsFree) {
  HapticSession session(ball_over_plane(), haptic_options());
  const auto force = [&] { return session.last().wrench.force_W.z(); };
  go(session, 4, 0, 200);
  go(session, 0, 0, 50);
  const Scalar pressed = force();
  ASSERT_GT(pressed, 1.5);
  const Scalar energy = session.last().energy_returned;
  session.set_coupling(with_stiffness(3));
  go(session, 0, 0, 20);
  EXPECT_NEAR(force(), pressed, 1e-6);
  EXPECT_EQ(session.coupling().stiffness.z(), 1);
  session.set_coupling(with_stiffness(0.5));
  go(session, 0, 0, 1);
  EXPECT_NEAR(force(), pressed / 2, 0.01);
  EXPECT_EQ(session.last().energy_returned, energy);
  session.set_coupling(with_stiffness(3));
  go(session, 0, 4, 200);
  EXPECT_EQ(session.last().status, HapticStatus::Free);
  EXPECT_EQ(session.coupling().stiffness.z(), 3);
  go(session, 4, 0, 200);
  go(session, 0, 0, 50);
  EXPECT_NEAR(force(), 3 * pressed, 0.03);
  CouplingOptions wrong = with_stiffness(0);
  EXPECT_THROW(session.set_coupling(wrong), InvalidArgument);
}

// Stiffer while pressed, softer while free: done at once that would pump energy into the hand.
TEST(ToolChange, ChangesOfStiffnessGiveTheHandNoEnergy) {
  const auto energy_of = [](bool changes) {
    HapticSession session(ball_over_plane(), haptic_options());
    for (int cycle = 0; cycle < 5; ++cycle) {
      go(session, 4, 0, 150);
      if (changes) session.set_coupling(with_stiffness(4));
      go(session, 0, 4, 150);
      if (changes) session.set_coupling(with_stiffness(1));
    }
    return session.last().energy_returned;
  };
  EXPECT_EQ(energy_of(true), energy_of(false));
}

TEST(ToolChange, ResetItIsAsInANewSession) {
  const auto organ = testing::icosphere(3, 10);
  HapticScene scene = testing::ball_tool(2, {0, 0, 13});
  scene.obstacles.push_back(testing::deforming_tissue(organ, 0.2));
  ToolObstacle soft;
  soft.role = ObstacleRole::SoftRegion;
  soft.shape = testing::shared_mesh(testing::icosphere(2, 4));
  soft.X_WO = RigidPose(Vector3(0, 0, 22));
  soft.margin = 1;
  soft.soft_stiffness = 1;
  scene.obstacles.push_back(soft);
  HapticSession session(scene, haptic_options());
  const auto stroke = [](int k) {
    return device_at({6 * std::sin(0.02 * k), 4 * std::sin(0.03 * k), 13 - 6 * std::sin(0.01 * k)});
  };
  for (int k = 0; k < 250; ++k) session.update(stroke(k), kMillisecond);
  const ToolPose elsewhere{RigidPose(Vector3(0, 1, 14)), {}};
  session.reset(elsewhere);
  scene.X_WT = elsewhere.X_WT;
  HapticSession fresh(scene, haptic_options());
  for (int k = 0; k < 250; ++k) {
    const HapticTick& tick = session.update(stroke(k), kMillisecond);
    const HapticTick& other = fresh.update(stroke(k), kMillisecond);
    ASSERT_EQ(tick.status, other.status) << k;
    ASSERT_EQ(tick.tool.X_WT.translation(), other.tool.X_WT.translation()) << k;
    ASSERT_EQ(tick.wrench.force_W, other.wrench.force_W) << k;
    ASSERT_EQ(tick.clearances[0].lower, other.clearances[0].lower) << k;
  }
}

TEST(ToolChange, ResetIntoTissueItLeavesIt) {
  HapticSession session(ball_over_plane(), haptic_options());
  go(session, 4, 4, 5);
  session.reset({RigidPose(Vector3(0.3, 0.2, 1)), {}});
  go(session, 4, 4, 1);
  EXPECT_EQ(session.last().status, HapticStatus::Overlapping);
  go(session, 4, 4, 300);
  EXPECT_EQ(session.last().status, HapticStatus::Free);
  ToolPose wrong;
  wrong.angles[0] = kInfinity;
  EXPECT_THROW(session.reset(wrong), InvalidArgument);
}

}  // namespace
}  // namespace dyop
