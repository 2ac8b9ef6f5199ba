// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/device_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

HapticScene ball_over_sheet(Scalar height) {
  HapticScene scene = testing::ball_tool(2, {0.3, 0.2, height});
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(40, 8)));
  return scene;
}

// A hand that strokes through the air and along tissue, one sample of which is 500 mm off.
int braked_after_an_outlier(const HapticOptions& options, Scalar depth) {
  HapticSession session(ball_over_sheet(4), options);
  int braked = 0;
  for (int k = 0; k < 1500; ++k) {
    const Scalar height = k < 300 ? 4 - (4 - depth) * std::sin(std::acos(-1) * k / 300) : 6;
    const Vector3 p(0.3 + 2 * std::sin(0.01 * k), 0.2, height);
    const bool is_off = k == 150;
    const HapticTick& tick =
        session.update(device_at(is_off ? Vector3(0, 0, -500) : p), kMillisecond);
    EXPECT_TRUE(!is_off || tick.tool.X_WT.translation().z() > 1.8);
    if (k > 450 && tick.wrench.force_W.norm() > 1e-9) ++braked;
  }
  EXPECT_EQ(session.last().status, HapticStatus::Free);
  return braked;
}

TEST(DeviceFilter, AnOutlierIsNotBrakedForTheRestOfTheRun) {
  HapticOptions options = haptic_options();
  options.coupling.bounds_energy = true;
  options.coupling.largest_force = 8;
  for (const Scalar speed : {kInfinity, 5000.0}) {
    options.largest_device_speed = speed;
    EXPECT_EQ(braked_after_an_outlier(options, 0), 0) << speed;
    EXPECT_EQ(braked_after_an_outlier(options, 3), 0) << speed;
  }
}

// The tool goes on as if the sample had not come, force included.
TEST(DeviceFilter, AnOutlierIsIgnoredAndSaid) {
  HapticOptions options = haptic_options();
  options.largest_device_speed = 5000;
  HapticSession session(ball_over_sheet(4), options);
  for (int k = 0; k < 100; ++k) {
    session.update(device_at({0.3, 0.2, std::max(1.0, 4 - 0.05 * k)}), kMillisecond);
  }
  const HapticTick before = session.last();
  const Scalar energy = before.energy_returned;
  DevicePose turned = device_at({0.3, 0.2, 1});
  turned.q_WD = Quaternion(0, 0, 0, 1);
  for (const DevicePose& off : {device_at({0.3, 500, 1}), turned}) {
    const HapticTick& tick = session.update(off, kMillisecond);
    EXPECT_EQ(tick.status, HapticStatus::Outlier);
    EXPECT_TRUE((tick.tool.X_WT.translation() - before.tool.X_WT.translation()).isZero(1e-6));
    EXPECT_TRUE((tick.wrench.force_W - before.wrench.force_W).isZero(1e-6));
    session.update(device_at({0.3, 0.2, 1}), kMillisecond);
    EXPECT_EQ(session.last().status, HapticStatus::Held);
  }
  EXPECT_NEAR(session.last().energy_returned, energy, 1e-9);
}

// A device that was carried elsewhere, or whose zero was set: from the second pose on it is
// followed.
TEST(DeviceFilter, AJumpThatIsConfirmedIsFollowedAndIsNoWorkOfTheHand) {
  HapticOptions options = haptic_options();
  options.largest_device_speed = 5000;
  HapticSession session(ball_over_sheet(4), options);
  for (int k = 0; k < 10; ++k) session.update(device_at({0.3, 0.2, 4}), kMillisecond);
  EXPECT_EQ(session.update(device_at({300, 0, 40}), kMillisecond).status, HapticStatus::Outlier);
  const Scalar energy = session.last().energy_returned;
  session.update(device_at({301, 0, 40}), kMillisecond);
  EXPECT_EQ(session.last().status, HapticStatus::Free);
  EXPECT_EQ(session.last().tool.X_WT.translation(), Vector3(301, 0, 40));
  EXPECT_EQ(session.last().energy_returned, energy);
  // After a pause it may have come far.
  for (int k = 0; k < 50; ++k) {
    DevicePose lost = device_at({0, 0, 0});
    lost.p_WD.x() = std::nan("");
    EXPECT_EQ(session.update(lost, kMillisecond).status, HapticStatus::InvalidInput);
  }
  EXPECT_EQ(session.update(device_at({301, 200, 40}), kMillisecond).status, HapticStatus::Free);
}

// Where rounding is as large as the rest offset nothing can be proven.
TEST(DeviceFilter, PosesBeyondAllMeasureAreInvalidAndDoNotHarm) {
  HapticSession session(ball_over_sheet(4), haptic_options());
  session.update(device_at({0.3, 0.2, 4}), kMillisecond);
  for (const Scalar far : {1e10, 1e30, 1e300}) {
    EXPECT_EQ(session.update(device_at({far, 0, 0}), kMillisecond).status,
              HapticStatus::InvalidInput);
    DevicePose device = device_at({0.3, 0.2, 4});
    device.angles[1] = far;
    EXPECT_EQ(session.update(device, kMillisecond).status, HapticStatus::InvalidInput);
    EXPECT_EQ(session.update(device_at({0.3, 0.2, 3.9}), kMillisecond).status, HapticStatus::Free);
  }
}

TEST(DeviceFilter, SnapshotsThatWouldStopTissueForGoodAreRefused) {
  HapticSession session(ball_over_sheet(4), haptic_options());
  std::vector<Vector3> vertices = testing::sheet(40, 8).vertices;
  const auto refusal = [&](Scalar duration) {
    return testing::message_of([&] { session.give_snapshot(0, vertices, duration); });
  };
  EXPECT_NE(refusal(1e-300).find("not 1e-300"), std::string::npos) << refusal(1e-300);
  EXPECT_NE(refusal(0).find("duration"), std::string::npos);
  EXPECT_NE(refusal(kInfinity).find("duration"), std::string::npos);
  for (const Scalar bad : {1e30, std::nan(""), kInfinity}) {
    vertices[7].y() = bad;
    EXPECT_NE(refusal(0.02).find("vertex 7"), std::string::npos) << refusal(0.02);
    EXPECT_THROW(session.give_mesh(0, vertices, testing::sheet(40, 8).triangles), InvalidArgument);
  }
  // Nothing has happened to the tissue.
  vertices[7].y() = 0;
  EXPECT_TRUE(session.give_snapshot(0, vertices, 0.02));
  for (int k = 0; k < 30; ++k) session.update(device_at({0.3, 0.2, 4}), kMillisecond);
  EXPECT_EQ(session.last().tissue_stopped, 0);
  EXPECT_EQ(session.snapshots_taken(0), 1);
}

TEST(DeviceFilter, RefusesASpeedThatIsNone) {
  HapticOptions options = haptic_options();
  options.largest_device_speed = -1;
  EXPECT_NE(testing::message_of([&] {
              HapticSession(ball_over_sheet(4), options);
            }).find("largest_device_speed must be > 0, not -1"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
