// SPDX-License-Identifier: BSD-3-Clause

// Tissue that deforms under a tool.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"
#include "support/oracles/proxy_oracle.h"

namespace dyop {
namespace {

using testing::ball_tool;
using testing::deforming_tissue;
using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

std::vector<Vector3> lifted(const std::vector<Vector3>& vertices, Scalar height) {
  std::vector<Vector3> result = vertices;
  for (Vector3& p : result) p.z() += height;
  return result;
}

TEST(ToolTissue, MovesFromSnapshotToSnapshotAndThenRests) {
  const auto sheet = testing::sheet(20, 4);
  HapticScene scene = ball_tool(2, {0, 0, 20});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  const auto height = [&] { return session.tissue_vertices(0)[0].z(); };
  EXPECT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, 1), 0.02));
  // Not taken yet.
  EXPECT_FALSE(session.give_snapshot(0, lifted(sheet.vertices, 5), 0.02));
  for (int k = 0; k < 5; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(session.snapshots_taken(0), 1);
  EXPECT_NEAR(height(), 0.25, 1e-9);
  EXPECT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, 3), 0.01));
  for (int k = 0; k < 20; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(session.snapshots_taken(0), 2);
  EXPECT_NEAR(height(), 1 + 2 * 0.5, 1e-9);
  for (int k = 0; k < 20; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(height(), 3);
  EXPECT_EQ(session.last().tissue_lag, 0);
}

TEST(ToolTissue, ASwapInTheMiddleOfATickIsKeptToTheTime) {
  const auto sheet = testing::sheet(20, 4);
  HapticScene scene = ball_tool(2, {0, 0, 20});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  session.give_snapshot(0, lifted(sheet.vertices, 1), 0.0025);
  session.update(device_at({0, 0, 20}), kMillisecond);
  session.give_snapshot(0, lifted(sheet.vertices, 0), 0.005);
  session.update(device_at({0, 0, 20}), kMillisecond);
  session.update(device_at({0, 0, 21}), kMillisecond);
  EXPECT_NEAR(session.tissue_vertices(0)[0].z(), 1 - 0.1, 1e-9);
  EXPECT_EQ(session.last().path.size(), 3u);
  EXPECT_EQ(session.last().status, HapticStatus::Free);
}

Scalar height_of(const HapticSession& session) {
  return session.tissue_vertices(0)[0].z();
}

TEST(ToolTissue, RetargetedItSetsOutFromWhereItIs) {
  const auto sheet = testing::sheet(20, 4);
  for (const int lead : {0, 3}) {
    HapticScene scene = ball_tool(2, {0, 0, 20});
    scene.obstacles.push_back(deforming_tissue(sheet));
    HapticSession session(scene, haptic_options());
    const auto pass = [&](int ticks) {
      for (int k = 0; k < ticks; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
    };
    session.give_snapshot(0, lifted(sheet.vertices, 1), 0.02);
    pass(5);
    // Never reached, as another one takes its place.
    EXPECT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, 9), 0.02));
    EXPECT_TRUE(session.retarget(0, lifted(sheet.vertices, -1), 0.01, lead * kMillisecond));
    pass(lead);
    const Scalar turned = 0.25 + 0.05 * lead;
    EXPECT_NEAR(height_of(session), turned, 1e-9);
    for (int k = 1; k <= 15; ++k) {
      pass(1);
      EXPECT_NEAR(height_of(session), turned - (turned + 1) * std::min(1.0, 0.1 * k), 1e-9) << k;
    }
    EXPECT_EQ(session.snapshots_taken(0), 2);
    EXPECT_EQ(session.last().progress[0].snapshot, 2);
    // At rest it is like any snapshot.
    EXPECT_TRUE(session.retarget(0, lifted(sheet.vertices, 2), 0.01));
    pass(5);
    EXPECT_NEAR(height_of(session), 0.5, 1e-9);
  }
}

TEST(ToolTissue, ACutIsNotTakenBack) {
  const auto sheet = testing::sheet(20, 4);
  HapticScene scene = ball_tool(2, {0, 0, 20});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  EXPECT_TRUE(session.give_mesh(0, sheet.vertices, sheet.triangles));
  EXPECT_FALSE(session.retarget(0, sheet.vertices, 0.01));
  session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_TRUE(session.retarget(0, sheet.vertices, 0.01));
  EXPECT_THROW(session.retarget(0, sheet.vertices, 0), InvalidArgument);
  EXPECT_THROW(session.retarget(0, sheet.vertices, 0.01, -1), InvalidArgument);
  EXPECT_THROW(session.retarget(1, sheet.vertices, 0.01), InvalidArgument);
}

// Tissue that the tool has stopped is sent back before it has come to its end.
TEST(ToolTissue, RetargetFreesTissueThatWasStopped) {
  const auto sheet = testing::sheet(30, 4);
  const auto upper = sheet.moved(Matrix3::Identity(), {0, 0, 5});
  HapticScene scene = ball_tool(2, {0.3, 0.2, 2.5});
  scene.obstacles.push_back(deforming_tissue(sheet));
  scene.obstacles.push_back(deforming_tissue(upper));
  HapticSession session(scene, haptic_options());
  session.give_snapshot(0, lifted(sheet.vertices, 2), 0.05);
  session.give_snapshot(1, lifted(upper.vertices, -2), 0.05);
  for (int k = 0; k < 100; ++k) session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
  ASSERT_LT(session.last().progress[0].fraction, 1);
  const Scalar stopped = height_of(session);
  EXPECT_TRUE(session.retarget(0, sheet.vertices, 0.02));
  EXPECT_TRUE(session.retarget(1, upper.vertices, 0.02));
  session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
  EXPECT_NEAR(height_of(session), stopped * 0.95, 1e-9);
  for (int k = 0; k < 20; ++k) session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
  EXPECT_EQ(height_of(session), 0);
}

// Another thread turns tissue round as often as it can, with and without a lead: it never jumps.
TEST(ToolTissue, RetargetedFromAnotherThreadItNeverJumps) {
  constexpr Scalar kHighest = 1, kPeriod = 0.01;
  const auto sheet = testing::sheet(20, 4);
  HapticScene scene = ball_tool(2, {0, 0, 20});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  std::atomic<bool> is_done{false};
  std::thread giver([&] {
    for (int k = 0; k < 400; ++k) {
      const Scalar height = k % 2 == 0 ? kHighest : -kHighest;
      session.retarget(0, lifted(sheet.vertices, height), kPeriod, k % 3 * kMillisecond);
    }
    is_done = true;
  });
  Scalar last = 0;
  while (!is_done) {
    session.update(device_at({0, 0, 20}), kMillisecond);
    const Scalar now = height_of(session);
    EXPECT_LE(std::abs(now - last), 2 * kHighest / kPeriod * kMillisecond * (1 + 1e-9));
    last = now;
  }
  giver.join();
  for (int k = 0; k < 50; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_EQ(session.last().progress[0].fraction, 1);
  EXPECT_TRUE(session.retarget(0, lifted(sheet.vertices, 0.5), kPeriod));
  for (int k = 0; k < 10; ++k) session.update(device_at({0, 0, 20}), kMillisecond);
  EXPECT_NEAR(height_of(session), 0.5, 1e-9);
}

// A sheet that is turned round in the middle of its motions, under a tool that presses on it.
TEST(ToolTissue, RetargetedTissueNeverPassesTheTool) {
  const auto sheet = testing::sheet(30, 8);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
  scene.obstacles.push_back(deforming_tissue(sheet, 0.2));
  HapticSession session(scene, haptic_options());
  const auto& tool = static_cast<const TriangleMesh&>(*scene.tool[0].shape);
  for (int k = 0; k < 300; ++k) {
    if (k % 7 == 0) {
      const Scalar height = k % 2 == 0 ? 2.5 : -1.5;
      ASSERT_TRUE(session.retarget(0, lifted(sheet.vertices, height), 0.02, k % 3 * kMillisecond));
    }
    testing::TissueSpan tissue{session.tissue_vertices(0), {}};
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 1.5}), kMillisecond);
    tissue.end = session.tissue_vertices(0);
    // Where it turns within the tick its path has a corner.
    if (tick.path.size() > 2) continue;
    const testing::ToolSpan span{tick.path[0].tool.X_WT, tick.path[1].tool.X_WT};
    const auto least = testing::sample_distance(tool, span, sheet.triangles, tissue, 0.0005, 0.001);
    EXPECT_GT(least.proven, 0) << k;
    EXPECT_GT(least.least, 0.0015) << k;
  }
  EXPECT_EQ(session.last().status, HapticStatus::Held);
}

// The device rests; a breathing sheet comes up under the tool, and takes it along.
TEST(ToolTissue, PushesARestingToolOutAndNeverPassesThroughIt) {
  const auto sheet = testing::sheet(30, 8);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
  scene.obstacles.push_back(deforming_tissue(sheet, 0.2));
  HapticSession session(scene, haptic_options());
  const auto& tool = static_cast<const TriangleMesh&>(*scene.tool[0].shape);
  Scalar highest = 0;
  for (int k = 0; k < 400; ++k) {
    if (k % 20 == 0) {
      const Scalar height = 3 * (1 - std::cos(2 * std::acos(-1) * (k / 20 + 1) / 10));
      ASSERT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, height), 0.02));
    }
    testing::TissueSpan tissue{session.tissue_vertices(0), {}};
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 4}), kMillisecond);
    tissue.end = session.tissue_vertices(0);
    highest = std::max(highest, tick.tool.X_WT.translation().z());
    ASSERT_EQ(tick.path.size(), 2u);
    const testing::ToolSpan span{tick.path[0].tool.X_WT, tick.path[1].tool.X_WT};
    const auto least = testing::sample_distance(tool, span, sheet.triangles, tissue, 0.0005, 0.001);
    EXPECT_GT(least.proven, 0) << k;
    EXPECT_GT(least.least, 0.0015) << k;
    EXPECT_EQ(tick.tissue_lag, 0);
  }
  // Up to 6, with the ball's radius of about 2 on top, and down again.
  EXPECT_GT(highest, 7.8);
  EXPECT_EQ(session.last().status, HapticStatus::Free);
}

// Two sheets close on a ball that cannot get out of the way: they stop, and it says so.
TEST(ToolTissue, TrappedFromBothSidesTheTissueIsStopped) {
  const auto sheet = testing::sheet(30, 4);
  const auto upper = sheet.moved(Matrix3::Identity(), {0, 0, 5});
  HapticScene scene = ball_tool(2, {0.3, 0.2, 2.5});
  scene.obstacles.push_back(deforming_tissue(sheet));
  scene.obstacles.push_back(deforming_tissue(upper));
  HapticSession session(scene, haptic_options());
  session.expect_snapshots(0);
  session.give_snapshot(0, lifted(sheet.vertices, 2), 0.05);
  session.give_snapshot(1, lifted(upper.vertices, -2), 0.05);
  bool was_trapped = false;
  Scalar stopped = 0;
  for (int k = 0; k < 100; ++k) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
    was_trapped |= tick.status == HapticStatus::Trapped;
    stopped += tick.tissue_stopped;
    EXPECT_NEAR(tick.tissue_lag, stopped, 1e-12) << k;
    EXPECT_NEAR(tick.tissue_behind, stopped, 1e-12) << k;
  }
  EXPECT_TRUE(was_trapped);
  EXPECT_GT(stopped, 0.01);
  const Scalar gap = session.tissue_vertices(1)[0].z() - session.tissue_vertices(0)[0].z();
  EXPECT_GT(gap, 3.8);
  EXPECT_LT(gap, 4.2);
}

// The same, and the hand pulls the ball out sideways: while the sheets stand it slides, and when it
// is out they close.
TEST(ToolTissue, WhatIsTrappedComesOutWhereTheHandPulls) {
  const auto sheet = testing::sheet(30, 4);
  const auto upper = sheet.moved(Matrix3::Identity(), {0, 0, 5});
  for (const Scalar friction : {0.0, 0.2}) {
    for (const int most : {1000, 20000}) {
      HapticScene scene = ball_tool(2, {0.3, 0.2, 2.5});
      scene.obstacles.push_back(deforming_tissue(sheet, friction));
      scene.obstacles.push_back(deforming_tissue(upper, friction));
      HapticOptions options = haptic_options();
      options.max_work = most;
      HapticSession session(scene, options);
      session.give_snapshot(0, lifted(sheet.vertices, 2), 0.05);
      session.give_snapshot(1, lifted(upper.vertices, -2), 0.05);
      for (int k = 0; k < 100; ++k) session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
      EXPECT_GT(session.last().tissue_lag, 0.01);
      for (int k = 0; k < 400; ++k) {
        const Scalar x = 0.3 + 0.2 * std::min(k, 200);
        session.update(device_at({x, 0.2, 2.5}), kMillisecond);
        EXPECT_GT(session.last().clearances[0].lower, 0) << k;
        EXPECT_GT(session.last().clearances[1].lower, 0) << k;
      }
      EXPECT_EQ(session.last().status, HapticStatus::Free)
          << friction << ' ' << most << ' ' << session.last().tool.X_WT.translation().transpose()
          << ' ' << words_of(session.last().status);
      EXPECT_EQ(session.last().tissue_lag, 0);
      EXPECT_NEAR(session.tissue_vertices(0)[0].z(), 2, 1e-9);
      EXPECT_NEAR(session.tissue_vertices(1)[0].z(), 3, 1e-9);
    }
  }
}

// A sheet closes on a ball under a rigid one, is stopped, and is told to open again.
TEST(ToolTissue, LagsOnlyBehindWhatWasGivenBeforeItWasStopped) {
  const auto sheet = testing::sheet(30, 4);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 2.5});
  scene.obstacles.push_back(deforming_tissue(sheet));
  scene.obstacles.push_back(
      testing::rigid_tissue(testing::shared_mesh(sheet.moved(Matrix3::Identity(), {0, 0, 5}))));
  HapticSession session(scene, haptic_options());
  Scalar stopped = 0;
  const auto expect_lag_since = [&](Scalar before) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
    stopped += tick.tissue_stopped;
    EXPECT_NEAR(tick.tissue_lag, stopped - before, 1e-12);
  };
  // At 50 per second the ball and its gaps are reached after 19 ms: two more milliseconds of the
  // way are left.
  ASSERT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, 1.05), 0.021));
  for (int k = 0; k < 60; ++k) expect_lag_since(0);
  EXPECT_GT(stopped, 0.03);
  // What is newer was not late when it was given.
  ASSERT_TRUE(session.give_snapshot(0, lifted(sheet.vertices, -1), 0.02));
  const Scalar before = stopped;
  for (int k = 0; k < 10; ++k) expect_lag_since(before);
  EXPECT_GT(stopped, before);
}

TEST(ToolTissue, ALateSnapshotLetsTheTissueRest) {
  const auto sheet = testing::sheet(30, 4);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 2.2});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  session.give_snapshot(0, lifted(sheet.vertices, 0.5), 0.01);
  for (int k = 0; k < 50; ++k) session.update(device_at({0.3, 0.2, 1}), kMillisecond);
  const Vector3 before = session.last().tool.X_WT.translation();
  for (int k = 0; k < 5; ++k) session.update(device_at({0.3, 0.2, 1}), kMillisecond);
  EXPECT_LT((session.last().tool.X_WT.translation() - before).norm(), 0.001);
  session.give_snapshot(0, lifted(sheet.vertices, 1), 0.01);
  for (int k = 0; k < 50; ++k) session.update(device_at({0.3, 0.2, 1}), kMillisecond);
  EXPECT_NEAR(session.last().tool.X_WT.translation().z(), before.z() + 0.5, 0.01);
}

TEST(ToolTissue, SnapshotsMayComeFromAnotherThread) {
  const auto sheet = testing::sheet(30, 8);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  std::atomic<bool> is_done{false};
  std::thread giver([&] {
    for (int k = 0; !is_done; ++k) {
      while (!session.give_snapshot(0, lifted(sheet.vertices, k % 2 == 0 ? 2 : 0), 0.005)) {
        if (is_done) return;
        std::this_thread::yield();
      }
    }
  });
  // Ticks are quick: until the other thread has had its turns.
  constexpr int kSnapshots = 20, kMostTicks = 400000;
  for (int k = 0; k < kMostTicks && session.snapshots_taken(0) < kSnapshots; ++k) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 1}), kMillisecond);
    EXPECT_GT(tick.clearances[0].lower, 0) << k;
    std::this_thread::yield();
  }
  is_done = true;
  giver.join();
  EXPECT_EQ(session.snapshots_taken(0), kSnapshots);
}

// A ball that begins in a sheet leaves it at the recovery speed, and is reported until it is out.
TEST(ToolTissue, AToolThatBeginsInTissueLeavesItAtBoundedSpeed) {
  const auto sheet = testing::sheet(30, 8);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 0.8});
  scene.obstacles.push_back(deforming_tissue(sheet));
  const HapticOptions options = haptic_options();
  HapticSession session(scene, options);
  bool was_overlapping = false;
  for (int k = 0; k < 400; ++k) {
    const Vector3 before = session.last().tool.X_WT.translation();
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 0.8}), kMillisecond);
    const Scalar moved = (tick.tool.X_WT.translation() - before).norm();
    if (tick.status != HapticStatus::Overlapping) break;
    was_overlapping = true;
    EXPECT_LE(moved, options.recovery_speed * kMillisecond * (1 + 1e-9));
  }
  EXPECT_TRUE(was_overlapping);
  for (int k = 0; k < 100; ++k) session.update(device_at({0.3, 0.2, 0.8}), kMillisecond);
  EXPECT_EQ(session.last().status, HapticStatus::Held);
  EXPECT_GT(session.last().clearances[0].lower, 0.01);
  // To the nearer side.
  EXPECT_GT(session.last().tool.X_WT.translation().z(), 1.9);
}

// The device rests in a plate 0.5 above; the margin is that of a region switched on too late.
TEST(ToolTissue, AToolThatBeginsWithinAMarginIsPushedToItAndNeverNearer) {
  HapticScene scene = ball_tool(2, {0.3, 0.2, 3});
  ToolObstacle region = deforming_tissue(testing::sheet(30, 8));
  region.role = ObstacleRole::HardRegion;
  region.margin = 3;
  scene.obstacles.push_back(region);
  HapticSession session(scene, haptic_options());
  Scalar last = 0;
  bool was_recovering = false;
  for (int k = 0; k < 200; ++k) {
    const HapticTick& tick = session.update(device_at({0.3, 0.2, 2.5}), kMillisecond);
    was_recovering |= tick.status == HapticStatus::Recovering;
    EXPECT_GE(tick.clearances[0].upper, last - 0.01);
    last = std::min(tick.clearances[0].lower, 3.0);
  }
  EXPECT_TRUE(was_recovering);
  EXPECT_GE(session.last().clearances[0].lower, 3);
}

// Motions much longer than the tool is thick, which end nearer to tissue than its margin.
TEST(ToolTissue, ALongMotionEndsAtTheMargin) {
  const auto sheet = testing::sheet(60, 8);
  for (Scalar gap = -3; gap < 8; gap += 0.5) {
    SCOPED_TRACE(gap);
    HapticScene scene = ball_tool(2, {0.3, 0.2, 30});
    ToolObstacle organ = deforming_tissue(sheet);
    organ.margin = 5;
    scene.obstacles.push_back(organ);
    HapticSession session(scene, haptic_options());
    session.update(device_at({0.3, 0.2, 30}), kMillisecond);
    session.update(device_at({0.3, 0.2, 2 + gap}), kMillisecond);
    // Facets of the ball lie inside it.
    const Scalar height = session.last().tool.X_WT.translation().z();
    EXPECT_GT(height, 2 * 0.98 + 5);
    EXPECT_LT(height, std::max(2 + gap, 2 + 5.0) + 0.03);
  }
}

TEST(ToolTissue, RefusesBadSnapshots) {
  const auto sheet = testing::sheet(30, 4);
  HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
  scene.obstacles.push_back(deforming_tissue(sheet));
  HapticSession session(scene, haptic_options());
  EXPECT_THROW(session.give_snapshot(0, sheet.vertices, 0), InvalidArgument);
  EXPECT_THROW(session.give_snapshot(0, std::span(sheet.vertices).first(3), 1), InvalidArgument);
  auto bad = sheet.vertices;
  bad[3].x() = std::nan("");
  EXPECT_THROW(session.give_snapshot(0, bad, 1), InvalidArgument);
  EXPECT_TRUE(session.give_snapshot(0, sheet.vertices, 1));
}

// However little a tick may spend on clearances, their bounds hold while the tool flies about, and
// they are as close as the options say soon after it has come to rest.
TEST(ToolTissue, ClearancesHoldWhateverIsSpentOnThem) {
  for (const int most : {10, 20, 40}) {
    const auto sheet = testing::sheet(30, 20);
    HapticScene scene = ball_tool(2, {0, 0, 9});
    scene.obstacles.push_back(deforming_tissue(sheet));
    const Shape& ball = *scene.tool[0].shape;
    HapticOptions options = haptic_options();
    options.clearance_work = most;
    HapticSession session(scene, options);
    const TriangleMesh tissue(sheet.vertices, sheet.triangles);
    const auto truth = [&] {
      return distance(tissue, RigidPose(), ball, session.last().tool.X_WT, DistanceOptions{});
    };
    bool was_loose = false;
    for (int k = 0; k < 300; ++k) {
      const Scalar a = 0.05 * k;
      const HapticTick& tick = session.update(
          device_at({8 * std::cos(a), 6 * std::sin(2 * a), 8 + 4 * std::cos(3 * a)}), kMillisecond);
      const ToolClearance& told = tick.clearances[0];
      EXPECT_LE(told.lower, truth().upper) << k;
      EXPECT_GE(told.upper, truth().lower) << k;
      was_loose |= told.upper - told.lower > 0.1 * told.upper;
    }
    EXPECT_TRUE(was_loose || most > 10) << most;
    for (int k = 0; k < 200; ++k) session.update(device_at({3, 1, 8}), kMillisecond);
    const ToolClearance& told = session.last().clearances[0];
    EXPECT_LE(told.upper - told.lower,
              options.clearance_tolerance * told.lower + options.rest_offset / 2);
  }
}

// Each tick ends before it has seen all that is near where the ball lies on tissue. It must come
// off once the device has left, though not at once.
TEST(ToolTissue, AToolThatIsCutOffInEveryTickComesOff) {
  for (const int most : {5, 8, 10, 15}) {
    HapticScene scene = ball_tool(50, {0, 0, 50.1}, 4);
    scene.obstacles.push_back(deforming_tissue(testing::sheet(30, 60), 0.3));
    HapticSession session(scene, haptic_options());
    for (int k = 0; k < 200; ++k) session.update(device_at({0, 0, 50 - 0.005 * k}), kMillisecond);
    int cut = 0;
    for (int k = 0; k < 1000; ++k) {
      const Scalar height = std::min(49 + 0.01 * k, Scalar{54});
      const HapticTick& tick =
          session.replay(device_at({0, 0, height}), kMillisecond, TickCutoff{most, 0});
      EXPECT_GT(tick.clearances[0].lower, 0) << k;
      cut += tick.cutoff.has_value();
    }
    EXPECT_GT(cut, 100) << most;
    EXPECT_NEAR(session.last().tool.X_WT.translation().z(), 54, 1e-3) << most;
  }
}

}  // namespace
}  // namespace dyop
