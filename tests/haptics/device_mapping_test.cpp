// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/device_mapping.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

class RandomHand {
 public:
  Vector3 vector(Scalar size) {
    return size * Vector3(uniform_(random_), uniform_(random_), uniform_(random_));
  }
  DevicePose moved(const DevicePose& from, Scalar by) {
    DevicePose to = from;
    to.p_WD += vector(by);
    const Matrix3 R = rotation_from_vector(vector(0.1 * by)) * from.q_WD.toRotationMatrix();
    to.q_WD = Quaternion(R).normalized();
    return to;
  }

 private:
  std::mt19937_64 random_{3};
  std::uniform_real_distribution<Scalar> uniform_{-1, 1};
};

Vector3 turn_between(const DevicePose& a, const DevicePose& b) {
  return rotation_vector(b.q_WD.toRotationMatrix() * a.q_WD.toRotationMatrix().transpose());
}

DeviceMappingOptions some_options(RandomHand& hand) {
  DeviceMappingOptions options;
  options.R_WV = rotation_from_vector(hand.vector(2));
  options.scale = 0.3;
  options.rotation_scale = 0.7;
  return options;
}

TEST(DeviceMapping, GivesTheHandThePowerOfTheTool) {
  RandomHand hand;
  DeviceMapping mapping(some_options(hand), RigidPose(hand.vector(5)));
  DevicePose device(RigidPose(hand.vector(50)));
  DevicePose tool = mapping.to_tool(device);
  for (int k = 0; k < 200; ++k) {
    const DevicePose device_then = hand.moved(device, 3);
    const DevicePose tool_then = mapping.to_tool(device_then);
    const ToolWrench wrench{hand.vector(10), hand.vector(100)};
    const ToolWrench felt = mapping.to_hand(wrench);
    EXPECT_NEAR(felt.force_W.dot(device_then.p_WD - device.p_WD),
                wrench.force_W.dot(tool_then.p_WD - tool.p_WD), 1e-10);
    EXPECT_NEAR(felt.torque_W.dot(turn_between(device, device_then)),
                wrench.torque_W.dot(turn_between(tool, tool_then)), 1e-9);
    EXPECT_NEAR((tool_then.p_WD - tool.p_WD).norm(), 0.3 * (device_then.p_WD - device.p_WD).norm(),
                1e-12);
    device = device_then;
    tool = tool_then;
  }
}

TEST(DeviceMapping, TheClutchLeavesTheToolWhereItIs) {
  RandomHand hand;
  DeviceMapping mapping(some_options(hand), RigidPose(Vector3(1, 2, 3)));
  DevicePose device(RigidPose(hand.vector(50)));
  EXPECT_EQ(mapping.to_tool(device).p_WD, Vector3(1, 2, 3));
  device = hand.moved(device, 5);
  const DevicePose before = mapping.to_tool(device, true);
  for (int k = 0; k < 10; ++k) {
    device = hand.moved(device, 20);
    const DevicePose held = mapping.to_tool(device, true);
    EXPECT_EQ(held.p_WD, before.p_WD);
    EXPECT_LE(turn_between(before, held).norm(), 1e-12);
    EXPECT_TRUE(mapping.to_hand({hand.vector(1), hand.vector(1)}).force_W.isZero(0));
  }
  const DevicePose again = mapping.to_tool(device);
  EXPECT_EQ(again.p_WD, before.p_WD);
  EXPECT_FALSE(mapping.to_hand({hand.vector(1), hand.vector(1)}).force_W.isZero(0));
  mapping.reset(RigidPose(Vector3(7, 8, 9)));
  EXPECT_EQ(mapping.to_tool(device).p_WD, Vector3(7, 8, 9));
}

TEST(DeviceMapping, WhatIsNoPoseOrFarOffLeavesNothingBehind) {
  RandomHand hand;
  DeviceMapping mapping(some_options(hand), RigidPose());
  DevicePose device(RigidPose(hand.vector(50)));
  const DevicePose before = mapping.to_tool(device);
  DevicePose bad = device;
  bad.p_WD.x() = std::numeric_limits<Scalar>::quiet_NaN();
  bad.angles[1] = 0.5;
  bad.buttons = 6;
  const DevicePose handed_on = mapping.to_tool(bad);
  EXPECT_TRUE(std::isnan(handed_on.p_WD.x()));
  EXPECT_EQ(handed_on.angles[1], 0.5);
  EXPECT_EQ(handed_on.buttons, 6u);
  mapping.to_tool(hand.moved(device, 500));
  const DevicePose after = mapping.to_tool(device);
  EXPECT_LE((after.p_WD - before.p_WD).norm(), 1e-12);
  EXPECT_LE(turn_between(before, after).norm(), 1e-10);
  DeviceMappingOptions wrong;
  wrong.scale = 0;
  EXPECT_THROW(DeviceMapping(wrong, {}), InvalidArgument);
  wrong.scale = 1;
  wrong.R_WV(0, 0) = 2;
  EXPECT_THROW(DeviceMapping(wrong, {}), InvalidArgument);
}

// Presses and lets go through a mapping, with the clutch opened and closed on the way: the work on
// the hand is what the session has counted for the tool, and at most nothing.
TEST(DeviceMapping, AStrokeReturnsNoEnergy) {
  HapticScene scene = testing::ball_tool(2, {0, 0, 4});
  scene.obstacles.push_back(testing::rigid_tissue(testing::shared_mesh(testing::sheet(40, 8))));
  HapticSession session(scene, haptic_options());
  DeviceMappingOptions options;
  options.scale = 0.5;
  DeviceMapping mapping(options, scene.X_WT);
  Scalar work = 0;
  ToolWrench felt;
  Vector3 last(0, 0, 100);
  for (int k = 0; k <= 1200; ++k) {
    // 12 mm down, 6 mm of the tool, and back; for a while the hand goes aside with an open clutch.
    const bool is_open = k > 600 && k <= 800;
    Scalar down = 0;
    if (k <= 600) down = 12 * std::min(1.0, k / 500.0);
    if (k > 600) down = 12 * (1 - std::clamp((k - 800) / 300.0, 0.0, 1.0));
    const Vector3 hand(is_open ? 0.1 * (k - 600) : 0, 0, 100 - down);
    work += felt.force_W.dot(hand - last);
    last = hand;
    session.update(mapping.to_tool(device_at(hand), is_open), kMillisecond);
    felt = mapping.to_hand(session.last().wrench);
    if (k == 550) {
      EXPECT_GT(felt.force_W.z(), 1);
    }
  }
  // A spring that is sampled returns K T v / 2 for a way at speed v, here of the tool.
  EXPECT_LE(work, 2 * 1 * kMillisecond * 20 / 2 * 6);
  EXPECT_NEAR(work, session.last().energy_returned, 1e-9);
}

}  // namespace
}  // namespace dyop
