// SPDX-License-Identifier: BSD-3-Clause

// Hard places for a tool: between jaws, between moving walls, in a narrow hole. The force must be
// steady, and a tool that cannot get to the device must say so.

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
using testing::rigid_tissue;
using testing::shared_mesh;

constexpr Scalar kJitter = 0.02;       // of the force, from tick to tick
constexpr Scalar kJawStiffness = 400;  // N mm a radian
constexpr Scalar kOpen = 0.4;          // angle of each jaw
constexpr int kClosing = 300;          // ticks

// Two jaws along x, whose hinges along y lie at the origin, one below and one above.
HapticScene grasper() {
  HapticScene scene;
  const Matrix3 R = rotation_from_vector(Vector3(-std::acos(-1) / 2, 0, 0));  // z of J is y
  scene.tool.push_back({shared_mesh(testing::box_mesh({1, 1, 1})), RigidPose(Vector3(-3, 0, 0))});
  for (const Scalar side : {1.0, -1.0}) {
    scene.hinges.push_back({RigidPose(R, Vector3::Zero()), -side * kOpen, kJawStiffness});
    scene.tool.push_back({shared_mesh(testing::box_mesh({6, 1, 0.3})),
                          RigidPose(Vector3(8, 0, side * 0.4)), scene.hinges.size() - 1});
  }
  return scene;
}

// Closing beyond what is between.
DevicePose closing(int tick) {
  DevicePose device = device_at({0, 0, 0});
  const Scalar angle = kOpen - (kOpen + 0.1) * std::min(tick, kClosing) / kClosing;
  device.angles[0] = -angle;
  device.angles[1] = angle;
  return device;
}

// The force of a jaw on what it holds, and its moment about the hinge.
struct JawLoad {
  Vector3 force_W = Vector3::Zero();
  Scalar moment = 0;
};

JawLoad load_of(const HapticTick& tick, std::size_t part) {
  JawLoad load;
  for (const ToolContactPoint& contact : tick.contacts) {
    if (contact.part != part) continue;
    const Vector3 arm = contact.p_W - tick.tool.X_WT.translation();
    load.force_W += contact.force_W;
    load.moment += arm.cross(contact.force_W).y();
  }
  return load;
}

// The jaws press with the springs of their hinges, the frame feels nothing, and all is steady.
void expect_firm_grasp(HapticSession& session) {
  for (int k = 0; k < kClosing + 100; ++k) session.update(closing(k), kMillisecond);
  JawLoad last = load_of(session.last(), 1);
  for (int k = 0; k < 200; ++k) {
    const HapticTick& tick = session.update(closing(kClosing), kMillisecond);
    ASSERT_EQ(tick.status, HapticStatus::Held) << words_of(tick.status);
    for (std::size_t jaw = 0; jaw < 2; ++jaw) {
      const Scalar asked = closing(kClosing).angles[jaw];
      const Scalar torque = kJawStiffness * std::abs(tick.tool.angles[jaw] - asked);
      EXPECT_GT(torque, 5);
      EXPECT_NEAR(std::abs(load_of(tick, jaw + 1).moment), torque, 0.02 * torque) << k;
    }
    const JawLoad load = load_of(tick, 1);
    EXPECT_LE((load.force_W - last.force_W).norm(), kJitter * last.force_W.norm()) << k;
    EXPECT_LE(tick.wrench.force_W.norm(), kJitter * last.force_W.norm()) << k;
    last = load;
  }
}

TEST(ToolScenario, AStiffGraspOfARigidBodyIsSteady) {
  HapticScene scene = grasper();
  scene.obstacles.push_back(
      rigid_tissue(std::make_shared<Box>(Vector3(1.5, 3, 1)), RigidPose(Vector3(9, 0, 0)), 0.3));
  HapticSession session(scene, haptic_options());
  expect_firm_grasp(session);
}

TEST(ToolScenario, AStiffGraspOfTissueIsSteady) {
  HapticScene scene = grasper();
  scene.obstacles.push_back(testing::deforming_tissue(
      testing::icosphere(3, 1.5).moved(Matrix3::Identity(), {9, 0, 0}), 0.3));
  HapticSession session(scene, haptic_options());
  expect_firm_grasp(session);
}

// Tissue between the closed jaws goes up and down, and takes the tool along: it is held from both
// sides, the force changes without a jump, and nothing is passed.
TEST(ToolScenario, ATwoSidedTrapInMovingTissueIsSteady) {
  const auto ball = testing::icosphere(3, 1.5).moved(Matrix3::Identity(), {9, 0, 0});
  HapticScene scene = grasper();
  scene.obstacles.push_back(testing::deforming_tissue(ball, 0.3));
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < kClosing + 100; ++k) session.update(closing(k), kMillisecond);
  Vector3 last = session.last().wrench.force_W;
  Scalar most = 0;
  std::vector<Vector3> vertices = ball.vertices;
  for (int k = 0; k < 1000; ++k) {
    if (k % 20 == 0) {
      const Scalar height = 1.5 * std::sin(2 * std::acos(-1) * (k + 20) / 1000);
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        vertices[i] = ball.vertices[i] + Vector3(0, 0, height);
      }
      ASSERT_TRUE(session.give_snapshot(0, vertices, 0.02));
    }
    const HapticTick& tick = session.update(closing(kClosing), kMillisecond);
    EXPECT_GT(tick.clearances[0].lower, 0) << k;
    EXPECT_NE(tick.status, HapticStatus::Free) << k;
    EXPECT_NE(tick.status, HapticStatus::Overlapping) << k;
    const Scalar grip = load_of(tick, 1).force_W.norm();
    EXPECT_LE((tick.wrench.force_W - last).norm(), kJitter * std::max(grip, last.norm())) << k;
    last = tick.wrench.force_W;
    most = std::max(most, last.norm());
  }
  EXPECT_GT(most, 0.5);  // it was taken along
}

// A needle of radius 0.4 in a hole of radius 0.5, pushed aside by 1 and through it.
TEST(ToolScenario, ANeedleInAHoleWithATenthOfPlayIsSteady) {
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Capsule>(0.4, 10), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, 3));
  scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::torus(2.5, 2, 64, 48))));
  HapticOptions options = haptic_options();
  options.rest_offset = 0.01;
  HapticSession session(scene, options);
  for (int k = 0; k <= 100; ++k) session.update(device_at({0.01 * k, 0, 3}), kMillisecond);
  // The needle is held 3 below the device's origin, so it also turns: two springs, one after the
  // other, take up what the play leaves.
  const Scalar give =
      1 / options.coupling.stiffness.x() + 3 * 3 / options.coupling.rotational_stiffness.x();
  const Scalar expected = (1 - (0.5 - 0.4 - options.rest_offset)) / give;
  EXPECT_NEAR(-session.last().wrench.force_W.x(), expected, 0.01 * expected);
  Vector3 last = session.last().wrench.force_W;
  for (int k = 1; k <= 600; ++k) {
    const HapticTick& tick = session.update(device_at({1, 0, 3 - 0.01 * k}), kMillisecond);
    EXPECT_EQ(tick.status, HapticStatus::Held) << k << " " << words_of(tick.status);
    EXPECT_GT(tick.clearances[0].lower, 0) << k;
    EXPECT_LE((tick.wrench.force_W - last).norm(), kJitter * last.norm())
        << k << " " << tick.wrench.force_W.transpose();
    last = tick.wrench.force_W;
  }
  EXPECT_NEAR(session.last().tool.X_WT.translation().z(), -3, 0.02);
}

// A needle too thick for its hole: it stops, and this is no success.
TEST(ToolScenario, ANeedleThatDoesNotFitIsNotReportedAsFree) {
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Capsule>(0.6, 4), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, 9));
  scene.obstacles.push_back(rigid_tissue(shared_mesh(testing::torus(2.5, 2, 64, 48))));
  HapticOptions options = haptic_options();
  options.coupling.rotational_stiffness = Vector3::Constant(1e5);  // it shall not turn aside
  HapticSession session(scene, options);
  for (int k = 0; k <= 400; ++k) session.update(device_at({0, 0, 9 - 0.02 * k}), kMillisecond);
  for (int k = 0; k < 50; ++k) {
    const HapticTick& tick = session.update(device_at({0, 0, 1}), kMillisecond);
    EXPECT_EQ(tick.status, HapticStatus::Held);
    EXPECT_GT(tick.clearances[0].lower, 0);
  }
  EXPECT_GT(session.last().tool.X_WT.translation().z(), 4);
  EXPECT_NEAR(session.last().wrench.force_W.z(), session.last().tool.X_WT.translation().z() - 1,
              0.01);
}

}  // namespace
}  // namespace dyop
