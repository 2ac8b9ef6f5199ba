// SPDX-License-Identifier: BSD-3-Clause

// A ball in a groove between two walls, each inclined by an angle from the groove's middle plane. A
// ball that is pressed in by a force is wedged by friction if the angle is below that of friction:
// it then needs no force to stay, and could hold any.

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

constexpr Scalar kBallRadius = 2;
constexpr Scalar kWallFriction = 0.3;  // its angle is 0.291
constexpr Scalar kSteep = 0.17;        // inclination below that ...
constexpr Scalar kFlat = 0.45;         // ... and above

// The wall at +x or -x, side = 1 or -1, whose surface passes through the origin, moved by shift.
testing::MeshArrays wall(Scalar inclination, Scalar side, Scalar shift) {
  const Scalar right = std::acos(-1) / 2;
  const Matrix3 R = rotation_from_vector(Vector3(0, side * (inclination - right), 0));
  return testing::sheet(40, 4).moved(R, {shift, 0, 0});
}

// The ball touches both walls, besides the rest offset, where its centre is this high.
Scalar height(Scalar inclination, Scalar narrower = 0) {
  return (kBallRadius + haptic_options().rest_offset) / std::sin(inclination) +
         narrower / std::tan(inclination);
}

HapticScene groove(Scalar inclination) {
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Sphere>(kBallRadius), RigidPose()});
  scene.X_WT = RigidPose(Vector3(0, 0, height(inclination)));
  for (const Scalar side : {1.0, -1.0}) {
    scene.obstacles.push_back(testing::deforming_tissue(wall(inclination, side, 0), kWallFriction));
  }
  return scene;
}

class ToolWedge : public ::testing::TestWithParam<Scalar> {
 protected:
  const Scalar inclination = GetParam();
  const Scalar top = height(inclination);
  HapticSession session{groove(inclination), haptic_options()};

  const HapticTick& go_to(Scalar x, Scalar z) {
    return session.update(device_at({x, 0, z}), kMillisecond);
  }
  Vector3 place() const { return session.last().tool.X_WT.translation(); }
  // The ball is pulled down by this length of the spring.
  void press(Scalar depth) {
    for (int k = 1; k <= 300; ++k) go_to(0, top - depth * k / 300);
    EXPECT_EQ(session.last().status, HapticStatus::Held);
    EXPECT_NEAR(place().z(), top, haptic_options().rest_offset);
    EXPECT_NEAR(session.last().wrench.force_W.z(), depth, 0.01 * depth);
  }
};

TEST_P(ToolWedge, LetsGoOfAToolThatIsPulledOut) {
  press(3);
  for (int k = 1; k < 300; ++k) {
    go_to(0, top - 3 + 0.01 * k);
    EXPECT_NEAR(place().z(), top, haptic_options().rest_offset) << k;
  }
  for (int k = 1; k <= 100; ++k) {
    EXPECT_EQ(go_to(0, top + 0.01 * k).status, HapticStatus::Free) << k;
  }
}

// The device goes around, and pulls the ball to one wall, then along it: by as much as friction at
// that wall alone admits, though friction at both could hold the ball for ever.
TEST_P(ToolWedge, DoesNotStoreForces) {
  constexpr Scalar kPull = 3;
  press(kPull);
  const Vector3 along(std::sin(inclination), 0, std::cos(inclination));
  const Vector3 inwards(std::cos(inclination), 0, -std::sin(inclination));
  for (int k = 0; k <= 1800; ++k) {
    const Scalar angle = k * std::acos(-1) / 1800;
    const Vector3 pull(kPull * std::sin(angle), 0, -kPull * std::cos(angle));
    go_to(pull.x(), top + pull.z());
    if (!(pull.dot(inwards) > 0.1)) break;
    const Scalar slid = std::max(Scalar{0}, pull.dot(along) - kWallFriction * pull.dot(inwards));
    EXPECT_NEAR((place() - Vector3(0, 0, top)).dot(along), slid, 2 * haptic_options().rest_offset)
        << k;
  }
  EXPECT_GT(place().z(), top + 1);
}

// The walls move at a given speed, whatever force that takes: the ball must go where there is space
// for it. In the narrow groove friction forbids that; it is friction that gives way.
TEST_P(ToolWedge, ThatClosesPushesTheToolOut) {
  press(2);
  constexpr int kTicks = 20;        // of a snapshot
  constexpr Scalar kCloser = 0.02;  // each wall, in a snapshot
  for (int k = 0; k < 400; ++k) {
    if (k % kTicks == 0) {
      const Scalar narrower = kCloser * (1 + k / kTicks);
      ASSERT_TRUE(session.give_snapshot(0, wall(inclination, 1, -narrower).vertices, 0.02));
      ASSERT_TRUE(session.give_snapshot(1, wall(inclination, -1, narrower).vertices, 0.02));
    }
    const HapticTick& tick = go_to(0, top - 2);
    const Scalar expected = height(inclination, kCloser * (k + 1) / kTicks);
    EXPECT_EQ(tick.status, HapticStatus::Held) << k;
    EXPECT_EQ(tick.tissue_lag, 0) << k;
    EXPECT_NEAR(place().z(), expected, haptic_options().rest_offset) << k;
    EXPECT_NEAR(place().x(), 0, haptic_options().rest_offset) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Inclinations, ToolWedge, ::testing::Values(kSteep, kFlat));

}  // namespace
}  // namespace dyop
