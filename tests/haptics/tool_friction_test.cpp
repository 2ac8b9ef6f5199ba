// SPDX-License-Identifier: BSD-3-Clause

// What sticks does so at every speed of the hand.

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

constexpr Scalar kFriction = 0.3;
constexpr Scalar kPressed = 4;  // newtons, at 1 N/mm
constexpr Scalar kRadius = 2;

// A single vertex of an octahedron points down on a plate: contact is a point.
class ToolFriction : public ::testing::TestWithParam<Scalar> {
 protected:
  static HapticScene scene(bool deforms) {
    HapticScene scene;
    scene.tool.push_back({testing::shared_mesh({{{kRadius, 0, 0},
                                                 {-kRadius, 0, 0},
                                                 {0, kRadius, 0},
                                                 {0, -kRadius, 0},
                                                 {0, 0, kRadius},
                                                 {0, 0, -kRadius}},
                                                {{0, 2, 4},
                                                 {2, 1, 4},
                                                 {1, 3, 4},
                                                 {3, 0, 4},
                                                 {2, 0, 5},
                                                 {1, 2, 5},
                                                 {3, 1, 5},
                                                 {0, 3, 5}}}),
                          RigidPose()});
    scene.X_WT = RigidPose(Vector3(0.3, 0.2, kRadius + 0.5));
    const testing::MeshArrays plate = testing::sheet(40, 16);
    scene.obstacles.push_back(
        deforms ? testing::deforming_tissue(plate, kFriction)
                : testing::rigid_tissue(testing::shared_mesh(plate), RigidPose(), kFriction));
    return scene;
  }
  static Vector3 pressed(Scalar sideways) { return {0.3 + sideways, 0.2, kRadius - kPressed}; }
  static void press(HapticSession& session) {
    for (int k = 1; k <= 300; ++k) {
      session.update(device_at(pressed(0) + Vector3(0, 0, kPressed + 0.5) * (1 - k / 300.0)),
                     kMillisecond);
    }
    ASSERT_NEAR(session.last().wrench.force_W.z(), kPressed, 0.05);
  }
};

// Sideways force F at the tip turns the tool by F r / k_r, which lets the origin follow by r times
// that.
TEST_P(ToolFriction, HoldsInsideTheConeAtEverySpeedOfTheHand) {
  const Scalar speed = GetParam();
  for (const bool deforms : {false, true}) {
    HapticSession session(scene(deforms), haptic_options());
    press(session);
    const Scalar start = session.last().tool.X_WT.translation().x();
    for (Scalar x = 0; x < 1; x += speed * kMillisecond) {
      session.update(device_at(pressed(x)), kMillisecond);
    }
    session.update(device_at(pressed(1)), kMillisecond);
    const Scalar turn_stiffness = haptic_options().coupling.rotational_stiffness.x();
    const Scalar expected = 1 / (1 + kRadius * kRadius / turn_stiffness);
    EXPECT_NEAR(-session.last().wrench.force_W.x(), expected, 0.02) << deforms;
    EXPECT_LT(session.last().tool.X_WT.translation().x() - start, 0.04) << deforms;
  }
}

TEST_P(ToolFriction, SlidesAtTheCone) {
  const Scalar speed = GetParam();
  HapticSession session(scene(true), haptic_options());
  press(session);
  // Almost to the cone in large steps, then through it at the speed that is tested.
  for (Scalar x = 0; x < 1.15; x += 0.01) session.update(device_at(pressed(x)), kMillisecond);
  for (Scalar x = 1.15; x < 1.35; x += speed * kMillisecond) {
    session.update(device_at(pressed(x)), kMillisecond);
  }
  const Vector3 force = session.last().wrench.force_W;
  EXPECT_NEAR(-force.x(), kFriction * force.z(), 0.02 * kFriction * force.z());
}

INSTANTIATE_TEST_SUITE_P(MillimetresPerSecond, ToolFriction,
                         ::testing::Values(0.05, 0.1, 0.2, 0.4, 1, 5, 50));

// A tremor of 9 Hz and 0.2 mm about a force inside the cone, for ten seconds.
TEST_F(ToolFriction, TremorInsideTheConeDoesNotRatchet) {
  HapticSession session(scene(true), haptic_options());
  press(session);
  const auto hand = [](int k) {
    return device_at(pressed(0.6 + 0.2 * std::sin(2 * std::acos(-1) * 9 * k * kMillisecond)));
  };
  for (int k = 0; k < 60; ++k) session.update(device_at(pressed(0.01 * k)), kMillisecond);
  for (int k = 0; k < 1000; ++k) session.update(hand(k), kMillisecond);
  const Vector3 before = session.last().tool.X_WT.translation();
  for (int k = 0; k < 10'000; ++k) session.update(hand(k), kMillisecond);
  EXPECT_LT((session.last().tool.X_WT.translation() - before).norm(), 1e-3);
}

}  // namespace
}  // namespace dyop
