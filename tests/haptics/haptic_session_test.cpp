// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_scene.h"
#include "dyop/haptics/haptic_tick.h"
#include "support/allocation_count.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"
#include "support/oracles/proxy_oracle.h"

namespace dyop {
namespace {

using testing::ball_tool;
using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;
using testing::rigid_tissue;
using testing::shared_mesh;

// A ball of radius 2 over a sheet at z = 0.
HapticScene over_sheet(Scalar height, Scalar friction = 0) {
  HapticScene scene = ball_tool(2, {0.3, 0.2, height});
  scene.obstacles.push_back(
      rigid_tissue(shared_mesh(testing::sheet(40, 8)), RigidPose(), friction));
  return scene;
}

Scalar distance_now(const HapticScene& scene, const HapticTick& tick, std::size_t obstacle = 0) {
  return distance(*scene.tool[0].shape, tick.tool.X_WT, *scene.obstacles[obstacle].shape,
                  scene.obstacles[obstacle].X_WO)
      .lower;
}

TEST(HapticSession, FollowsTheDeviceExactlyInFreeSpace) {
  HapticSession session(over_sheet(10), haptic_options());
  for (int k = 1; k <= 20; ++k) {
    const RigidPose X_WD(rotation_from_vector(Vector3(0.02 * k, 0, 0.01 * k)),
                         Vector3(0.3, 0.2 + 0.1 * k, 10));
    const HapticTick& tick = session.update(DevicePose(X_WD), kMillisecond);
    EXPECT_EQ(tick.status, HapticStatus::Free);
    EXPECT_TRUE(tick.tool.X_WT.translation().isApprox(X_WD.translation(), 1e-12));
    EXPECT_TRUE(tick.tool.X_WT.rotation().isApprox(X_WD.rotation(), 1e-12));
    EXPECT_LT(tick.wrench.force_W.norm(), 1e-9);
  }
  EXPECT_NEAR(session.time(), 0.02, 1e-12);
}

TEST(HapticSession, AStabThroughASheetEndsOnItsNearSide) {
  const HapticScene scene = over_sheet(10);
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < 30; ++k) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 10.0 - k}), kMillisecond);
    EXPECT_GT(tick.tool.X_WT.translation().z(), 1.9);
    EXPECT_GT(distance_now(scene, tick), 0);
  }
  EXPECT_EQ(session.last().status, HapticStatus::Held);
  EXPECT_GT(session.last().wrench.force_W.z(), 15);
  ASSERT_FALSE(session.last().contacts.empty());
  EXPECT_GT(session.last().contacts[0].nhat_W.z(), 0.99);
}

TEST(HapticSession, AJumpOfMetresStopsAtTheSurfaceAndSlidesTowardsTheDevice) {
  const HapticScene scene = over_sheet(10);
  HapticSession session(scene, haptic_options());
  const auto& tool = static_cast<const TriangleMesh&>(*scene.tool[0].shape);
  const auto sheet = testing::sheet(40, 8);
  const auto check = [&](const HapticTick& tick) {
    for (std::size_t i = 1; i < tick.path.size(); ++i) {
      const testing::ToolSpan span{tick.path[i - 1].tool.X_WT, tick.path[i].tool.X_WT};
      const auto least = testing::sample_distance(tool, span, sheet.triangles,
                                                  {sheet.vertices, sheet.vertices}, 1e-3, 2e-3);
      EXPECT_GT(least.proven, 0);
      EXPECT_GT(least.least, 1e-3);
    }
  };
  check(session.update(device_at({1, -2, -3000}), kMillisecond));
  EXPECT_GT(session.last().tool.X_WT.translation().z(), 1.9);
  check(session.update(device_at({5, 3, -2000}), kMillisecond));
  // Over the rim, and then to the device.
  for (int k = 0; k < 40; ++k) {
    check(session.update(device_at({1000, 3, -3000}), kMillisecond));
  }
  EXPECT_EQ(session.last().status, HapticStatus::Free);
}

// Whatever it does with it, it does not throw, and does not pass.
TEST(HapticSession, APoseBeyondAllMeasureIsNotFollowedThroughTissue) {
  for (const Scalar far : {1e9, 1e20, 1e59}) {
    const HapticScene scene = over_sheet(4);
    HapticSession session(scene, haptic_options());
    for (int k = 0; k < 3; ++k) {
      const HapticTick& tick = session.update(device_at({0, 0, -far}), kMillisecond);
      EXPECT_NE(tick.status, HapticStatus::Free);
      EXPECT_GT(tick.tool.X_WT.translation().z(), 1.9);
    }
  }
}

TEST(HapticSession, BadInputIsAStatusAndLeavesTheProxyAndGivesNoForce) {
  HapticSession session(over_sheet(2.5), haptic_options());
  session.update(device_at({0.3, 0.2, 1}), kMillisecond);
  const RigidPose before = session.last().tool.X_WT;
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  DevicePose turned = device_at({0, 0, 5});
  turned.q_WD.coeffs() *= 2;
  DevicePose bad_angle = device_at({0, 0, 5});
  bad_angle.angles[0] = kInfinity;
  DevicePose unknown = device_at({0, 0, 5});
  unknown.p_WD.y() = nan;
  DevicePose far = device_at({0, 0, 5});
  far.p_WD.z() = kInfinity;
  for (const DevicePose& device : {unknown, far, turned, bad_angle}) {
    const HapticTick& tick = session.update(device, kMillisecond);
    EXPECT_EQ(tick.status, HapticStatus::InvalidInput);
    EXPECT_TRUE(tick.wrench.force_W.isZero(0));
    EXPECT_EQ(tick.tool.X_WT.translation(), before.translation());
  }
  for (const Scalar dt : {-1.0, nan, kInfinity}) {
    EXPECT_EQ(session.update(device_at({0, 0, 5}), dt).status, HapticStatus::InvalidInput);
  }
  EXPECT_EQ(session.update(device_at({0, 0, 5}), kMillisecond).status, HapticStatus::Free);
}

TEST(HapticSession, ATickOfNoLengthMovesNothing) {
  HapticSession session(over_sheet(10), haptic_options());
  session.update(device_at({0, 0, 10}), kMillisecond);
  const HapticTick& tick = session.update(device_at({0, 0, 9}), 0);
  EXPECT_EQ(tick.tool.X_WT.translation(), Vector3(0, 0, 10));
  EXPECT_NEAR(tick.wrench.force_W.z(), 1, 1e-12);
}

TEST(HapticSession, DoubleAndDroppedTicksAreOnlyOtherLengths) {
  const HapticScene scene = over_sheet(4);
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < 60; ++k) {
    const Scalar dt = k % 7 == 0 ? 3 * kMillisecond : k % 5 == 0 ? 0 : kMillisecond;
    const HapticTick& tick =
        session.update(device_at({0.3 + 0.2 * k, 0.2, 4 - 0.1 * std::min(k, 40)}), dt);
    EXPECT_GT(distance_now(scene, tick), 0.005);
  }
}

TEST(HapticSession, KeepsTheMarginOfAHardRegionAndReportsClearancesOfAll) {
  HapticScene scene = ball_tool(2, {0, 0, 20});
  ToolObstacle vessel = rigid_tissue(shared_mesh(testing::icosphere(3, 3)));
  vessel.role = ObstacleRole::HardRegion;
  vessel.margin = 2;
  ToolObstacle watched =
      rigid_tissue(std::make_shared<Box>(Vector3(1, 1, 1)), RigidPose(Vector3(30, 0, 0)));
  watched.role = ObstacleRole::Monitor;
  watched.margin = 25;
  scene.obstacles = {vessel, watched};
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < 40; ++k) {
    const HapticTick& tick = session.update(device_at({0, 0, 20.0 - k}), kMillisecond);
    ASSERT_EQ(tick.clearances.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      const DistanceResult truth = distance(*scene.tool[0].shape, tick.tool.X_WT,
                                            *scene.obstacles[i].shape, scene.obstacles[i].X_WO);
      EXPECT_LE(tick.clearances[i].lower, truth.upper);
      EXPECT_GE(tick.clearances[i].upper, truth.lower);
      EXPECT_LE(tick.clearances[i].upper - tick.clearances[i].lower,
                0.02 * truth.upper + haptic_options().rest_offset);
    }
    EXPECT_GE(tick.clearances[0].lower, 2);
    EXPECT_FALSE(tick.clearances[0].is_breached);
  }
  EXPECT_TRUE(session.last().clearances[1].is_breached ==
              (session.last().clearances[1].upper < 25));
}

// From a distance of 5 at one length unit a millisecond.
TEST(HapticSession, TimeToBreachIsNeverTooLong) {
  const HapticScene scene = over_sheet(10);
  HapticSession session(scene, haptic_options());
  session.update(device_at({0.3, 0.2, 9}), kMillisecond);
  const HapticTick& tick = session.update(device_at({0.3, 0.2, 8}), kMillisecond);
  const Scalar truth = distance_now(scene, tick) / (1 / kMillisecond);
  EXPECT_LE(tick.clearances[0].time_to_breach, truth);
  EXPECT_GE(tick.clearances[0].time_to_breach, 0.9 * truth);
  EXPECT_EQ(session.update(device_at({0.3, 0.2, 8}), kMillisecond).clearances[0].time_to_breach,
            kInfinity);
}

TEST(HapticSession, ASoftRegionPushesBackInProportion) {
  HapticScene scene = over_sheet(10);
  scene.obstacles[0].role = ObstacleRole::SoftRegion;
  scene.obstacles[0].margin = 3;
  scene.obstacles[0].soft_stiffness = 0.5;
  HapticSession session(scene, haptic_options());
  const HapticTick& tick = session.update(device_at({0.3, 0.2, 4}), kMillisecond);
  EXPECT_EQ(tick.status, HapticStatus::Free);
  const Scalar depth = 3 - distance_now(scene, tick);
  EXPECT_GT(depth, 0.5);
  EXPECT_NEAR(tick.wrench.force_W.z(), 0.5 * depth, 0.02 * depth);
}

TEST(HapticSession, AllocatesNothingAfterTheFirstTicks) {
  HapticScene scene = over_sheet(4, 0.3);
  scene.obstacles.push_back(
      testing::deforming_tissue(testing::icosphere(3, 5).moved(Matrix3::Identity(), {12, 0, 0})));
  HapticSession session(scene, haptic_options());
  const auto stroke = [&](int k) {
    const Scalar s = 2 * std::acos(-1) * (k % 700) / 700;
    session.update(
        device_at({0.3 + 5 * std::sin(s), 3 * std::sin(2 * s), 1.7 + 0.5 * std::cos(3 * s)}),
        kMillisecond);
  };
  for (int k = 0; k < 1400; ++k) stroke(k);
  const std::int64_t before = testing::allocation_count();
  for (int k = 1400; k < 2100; ++k) stroke(k);
  EXPECT_EQ(testing::allocation_count() - before, 0);
}

TEST(HapticSession, AllocatesNothingWithJawsEither) {
  HapticScene scene = over_sheet(4, 0.3);
  for (const Scalar side : {-1.0, 1.0}) {
    scene.hinges.push_back({RigidPose(Vector3(0, 0, -2)), 0.2 * side, 50});
    scene.tool.push_back({testing::shared_mesh(testing::box_mesh({1, 0.2, 0.2})),
                          RigidPose(Vector3(side, 0, 0)), scene.hinges.size() - 1});
  }
  HapticSession session(scene, haptic_options());
  const auto stroke = [&](int k) {
    const Scalar s = 2 * std::acos(-1) * (k % 700) / 700;
    DevicePose device =
        device_at({0.3 + 5 * std::sin(s), 3 * std::sin(2 * s), 2 + std::cos(3 * s)});
    device.angles = {0.2 * std::sin(2 * s), -0.2 * std::sin(2 * s)};
    return session.update(device, kMillisecond).contacts.size();
  };
  for (int k = 0; k < 1400; ++k) stroke(k);
  const std::int64_t before = testing::allocation_count();
  std::size_t contacts = 0;
  for (int k = 1400; k < 2100; ++k) contacts += stroke(k);
  EXPECT_EQ(testing::allocation_count() - before, 0);
  EXPECT_GT(contacts, 100u);
}

TEST(HapticSession, SameInputsGiveTheSameBits) {
  std::vector<Vector3> first;
  for (int run = 0; run < 2; ++run) {
    HapticSession session(over_sheet(4, 0.3), haptic_options());
    for (int k = 0; k < 200; ++k) {
      const HapticTick& tick =
          session.update(device_at({0.1 * k, 0.2, 4 - 0.03 * k}), kMillisecond);
      const Vector3& p = tick.tool.X_WT.translation();
      if (run == 0) {
        first.push_back(p);
      } else {
        EXPECT_EQ(p, first[std::size_t(k)]);
      }
    }
  }
}

TEST(HapticSession, PastTheDeadlineItKeepsWhatIsProvenAndAReplayEndsAtTheSamePlace) {
  const HapticScene scene = over_sheet(4, 0.3);
  HapticSession session(scene, haptic_options());
  HapticSession again(scene, haptic_options());
  // A quarter of the tolerance above the margin, which is zero; the tolerance is 0.3 rest offsets.
  const Scalar promised = 0.3 * haptic_options().rest_offset / 4 - 1e-9;
  int late = 0;
  for (int k = 0; k < 150; ++k) {
    const auto now = std::chrono::steady_clock::now();
    // Some have no time, some always enough; the others depend on the machine.
    const int us = k % 3 == 0 ? 0 : k % 10 == 1 ? 1'000'000 : k % 40;
    const auto deadline = now + std::chrono::microseconds(us);
    const DevicePose device = device_at({0.1 * k, 0.2, 4 - 0.03 * k});
    const HapticTick& tick = session.update(device, kMillisecond, deadline);
    late += tick.cutoff.has_value();
    EXPECT_GT(distance_now(scene, tick), promised);
    const HapticTick& replayed = again.replay(device, kMillisecond, tick.cutoff);
    EXPECT_EQ(replayed.cutoff, tick.cutoff);
    EXPECT_EQ(replayed.tool.X_WT.translation(), tick.tool.X_WT.translation());
    EXPECT_EQ(replayed.wrench.force_W, tick.wrench.force_W);
    EXPECT_EQ(replayed.status, tick.status);
  }
  EXPECT_GT(late, 20);
  EXPECT_LT(late, 150);
}

// A jaw closes on a sheet between: it stops, and the frame is not dragged along.
TEST(HapticSession, AJawThatMeetsTissueStopsThere) {
  HapticScene scene;
  const auto jaw =
      shared_mesh(testing::box_mesh({5, 0.5, 0.5}).moved(Matrix3::Identity(), {6, 0, 0}));
  scene.hinges.push_back({RigidPose(), 0.5, 0.1});
  scene.tool.push_back({shared_mesh(testing::box_mesh({0.5, 0.5, 0.5})), RigidPose()});
  scene.tool.push_back({jaw, RigidPose(), 0});
  // The sheet stands in the plane y = 0 from x = 3 on.
  const Matrix3 R = rotation_from_vector(Vector3(std::acos(-1) / 2, 0, 0));
  scene.obstacles.push_back(
      rigid_tissue(shared_mesh(testing::sheet(10, 4)), RigidPose(R, Vector3(8, 0, 0))));
  HapticSession session(scene, haptic_options());
  for (int k = 0; k < 100; ++k) {
    DevicePose device = device_at({0, 0, 0});
    device.angles[0] = 0.5 - 0.01 * k;
    session.update(device, kMillisecond);
  }
  const HapticTick& tick = session.last();
  EXPECT_EQ(tick.status, HapticStatus::Held);
  // The lower edge of the jaw's end, at (11, -0.5) in its frame, rests on y = 0: between there and
  // its middle.
  EXPECT_GT(tick.tool.angles[0], std::atan2(0.5, 11));
  EXPECT_LT(tick.tool.angles[0], 0.2);
  ASSERT_FALSE(tick.contacts.empty());
  EXPECT_EQ(tick.contacts[0].part, 1u);
  // Opened again it follows.
  DevicePose device = device_at({0, 0, 0});
  device.angles[0] = 0.4;
  EXPECT_EQ(session.update(device, kMillisecond).status, HapticStatus::Free);
  EXPECT_NEAR(session.last().tool.angles[0], 0.4, 1e-9);
}

TEST(HapticSession, RefusesScenesAndOptionsThatMakeNoSense) {
  const HapticScene scene = over_sheet(10);
  HapticOptions options = haptic_options();
  options.rest_offset = 0;
  EXPECT_NE(testing::message_of([&] { HapticSession(scene, options); }).find("rest_offset"),
            std::string::npos);
  HapticScene bad = scene;
  bad.tool.clear();
  EXPECT_THROW(HapticSession(bad, haptic_options()), InvalidArgument);
  bad = scene;
  bad.obstacles[0].margin = -1;
  EXPECT_THROW(HapticSession(bad, haptic_options()), InvalidArgument);
  bad = scene;
  bad.obstacles[0].shape = nullptr;
  EXPECT_THROW(HapticSession(bad, haptic_options()), InvalidArgument);
  bad = scene;
  bad.tool[0].hinge = 0;
  EXPECT_THROW(HapticSession(bad, haptic_options()), InvalidArgument);
  HapticSession session(scene, haptic_options());
  EXPECT_THROW(session.give_snapshot(0, {}, 1), InvalidArgument);
  EXPECT_THROW(session.tissue_vertices(7), InvalidArgument);
}

}  // namespace
}  // namespace dyop
