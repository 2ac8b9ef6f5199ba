// SPDX-License-Identifier: BSD-3-Clause

// HapticOptions::max_work: a tick ends after so much work, at the same place in every run.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "haptics/work_clock.h"
#include "support/inputs/haptic_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using haptics_internal::WorkClock;
using haptics_internal::WorkShare;
using testing::device_at;
using testing::kMillisecond;

TEST(WorkClock, IsOverAfterSoMuchWorkForGood) {
  WorkClock clock(20);
  clock.start(WorkClock::Deadline{});
  for (int k = 0; k < 4; ++k) EXPECT_FALSE(clock.is_over_small());
  EXPECT_FALSE(clock.is_over());
  EXPECT_FALSE(clock.is_over());
  EXPECT_EQ(clock.work(), 20);
  EXPECT_TRUE(clock.is_over_small());
  EXPECT_TRUE(clock.is_over());
  EXPECT_EQ(clock.cutoff(), (TickCutoff{7, 0}));
  clock.start(WorkClock::Deadline{});
  EXPECT_FALSE(clock.is_over());
}

TEST(WorkClock, LendsNoMoreNodePairsThanAreLeft) {
  WorkClock clock(28);
  clock.start(WorkClock::Deadline{});
  EXPECT_FALSE(clock.is_over());
  ToiOptions options;
  clock.lend(options);
  EXPECT_EQ(options.max_node_pairs, 11);
  ToiResult result;
  result.status = ToiStatus::Separated;
  result.statistics.node_pairs = 9;
  clock.take_back(result);
  EXPECT_EQ(clock.work(), 26);
  EXPECT_FALSE(clock.cutoff());
  result.status = ToiStatus::BudgetExhausted;
  clock.take_back(result);
  EXPECT_EQ(clock.cutoff(), (TickCutoff{1, 9}));
}

TEST(WorkClock, AShareIsUsedUpBeforeTheTick) {
  WorkClock clock;
  WorkShare share(clock, 3);
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(share.is_over_small());
  EXPECT_TRUE(share.is_used_up());
  EXPECT_TRUE(share.is_over());
  EXPECT_FALSE(clock.cutoff());
  EXPECT_FALSE(clock.is_over());
}

// The device jumps through an organ and back, and the organ breathes.
struct Jumps {
  explicit Jumps(std::int64_t most) {
    scene = testing::ball_tool(2, {0, 0, 9});
    scene.obstacles.push_back(testing::deforming_tissue(organ, 0.3));
    options = testing::haptic_options();
    options.max_work = most;
  }

  void give(HapticSession& session, int k) const {
    if (k % 20 != 0) return;
    std::vector<Vector3> places = organ.vertices;
    for (Vector3& p : places) p *= 1 + 0.02 * std::sin(0.01 * k);
    session.give_snapshot(0, places, 0.02);
  }
  static DevicePose device(int k) {
    const Scalar side = k / 40 % 2 == 0 ? 1 : -1;
    return device_at({0.3 * side, 0.02 * (k % 40), 7.5 * side});
  }

  testing::MeshArrays organ = testing::icosphere(4, 5);
  HapticScene scene;
  HapticOptions options;
};

// Facets that touch a cylinder of this radius about z from outside.
testing::MeshArrays bore(Scalar radius, Scalar half_length, int around, int along) {
  testing::MeshArrays arrays;
  const Scalar corner = radius / std::cos(std::numbers::pi / around);
  for (int k = 0; k <= along; ++k) {
    for (int i = 0; i < around; ++i) {
      const Scalar turn = 2 * std::numbers::pi * i / around;
      arrays.vertices.emplace_back(corner * std::cos(turn), corner * std::sin(turn),
                                   half_length * (2.0 * k / along - 1));
    }
  }
  for (std::int32_t k = 0; k < along; ++k) {
    for (std::int32_t i = 0; i < around; ++i) {
      const std::int32_t a = k * around + i, b = k * around + (i + 1) % around;
      arrays.triangles.push_back({a, b + around, b});
      arrays.triangles.push_back({a, a + around, b + around});
    }
  }
  return arrays;
}

TEST(WorkLimit, CutsOffAtTheSamePlaceInEveryRunAndStaysSafe) {
  const Jumps jumps(150);
  HapticSession session(jumps.scene, jumps.options), again(jumps.scene, jumps.options),
      replayed(jumps.scene, jumps.options);
  const Shape& ball = *jumps.scene.tool[0].shape;
  int cut = 0, whole = 0;
  for (int k = 0; k < 400; ++k) {
    for (HapticSession* one : {&session, &again, &replayed}) jumps.give(*one, k);
    const DevicePose device = Jumps::device(k);
    const HapticTick& tick = session.update(device, kMillisecond);
    const HapticTick& other = again.update(device, kMillisecond);
    const HapticTick& third = replayed.replay(device, kMillisecond, tick.cutoff);
    for (const HapticTick* same : {&other, &third}) {
      EXPECT_EQ(same->tool.X_WT.translation(), tick.tool.X_WT.translation()) << k;
      EXPECT_EQ(same->wrench.force_W, tick.wrench.force_W) << k;
      EXPECT_EQ(same->cutoff, tick.cutoff) << k;
      EXPECT_EQ(same->status, tick.status) << k;
    }
    cut += tick.cutoff.has_value();
    whole += !tick.cutoff.has_value();
    EXPECT_TRUE(tick.cutoff || tick.status != HapticStatus::Deadline) << k;
    // What is counted at once is one solve at most.
    EXPECT_LE(tick.statistics.work, 150 + 400) << k;
    if (k % 8 > 2) continue;
    const TriangleMesh tissue(session.tissue_vertices(0), jumps.organ.triangles);
    EXPECT_GT(distance(tissue, RigidPose(), ball, tick.tool.X_WT).lower, 0) << k;
  }
  EXPECT_GT(cut, 20);
  EXPECT_GT(whole, 100);
}

TEST(WorkLimit, ADeviceThatHasJumpedIsReachedOverSeveralTicks) {
  for (const std::int64_t most : {60, 150, 100000}) {
    const Jumps jumps(most);
    HapticSession session(jumps.scene, jumps.options);
    int ticks = 0;
    const Vector3 far(600, 30, 9);
    do {
      session.update(device_at(far), kMillisecond);
    } while ((session.last().tool.X_WT.translation() - far).norm() > 1e-6 && ++ticks < 100);
    EXPECT_LT(ticks, 100) << most;
    EXPECT_EQ(session.last().status, HapticStatus::Free) << most;
  }
}

// A large ball stabs into tissue of small triangles: more of them are near at once than a search
// for holds may look at. The proof holds it, and soon it rests as if it had been lowered.
TEST(WorkLimit, AStabIntoManyTrianglesIsHeldAndComesToRest) {
  HapticScene scene = testing::ball_tool(50, {0, 0, 51}, 4);
  const auto sheet = testing::sheet(30, 60);
  scene.obstacles.push_back(testing::deforming_tissue(sheet, 0.3));
  const HapticOptions options = testing::haptic_options();
  HapticSession session(scene, options);
  std::int64_t most = 0;
  for (int k = 0; k < 40; ++k) {
    const HapticTick& tick =
        session.update(device_at({0.1 * std::min(k, 20), 0, 49}), kMillisecond);
    EXPECT_GT(tick.clearances[0].lower, 0) << k;
    EXPECT_EQ(tick.tissue_stopped, 0) << k;
    most = std::max(most, tick.statistics.work);
  }
  EXPECT_GT(most, 500);
  EXPECT_EQ(session.last().status, HapticStatus::Held);
  const TriangleMesh tissue(sheet.vertices, sheet.triangles);
  const DistanceResult gap =
      distance(tissue, RigidPose(), *scene.tool[0].shape, session.last().tool.X_WT);
  EXPECT_GT(gap.lower, options.rest_offset / 2);
  EXPECT_LT(gap.upper, 2 * options.rest_offset);
}

// A frictionless shaft in a bore of 64 x 80 facets has thousands of triangles within reach. No tick is
// cut off, and it comes to rest at the point of the polygon of play that is nearest to the device.
TEST(WorkLimit, AShaftInAFinelyMeshedBoreIsSolvedInEveryTick) {
  constexpr int kAround = 64, kAlong = 80;
  constexpr Scalar kPlay = 0.05;
  const HapticOptions options = testing::haptic_options();
  HapticScene scene;
  scene.tool.push_back({std::make_shared<Capsule>(2 - kPlay, 15), RigidPose()});
  scene.obstacles.push_back(
      testing::rigid_tissue(testing::shared_mesh(bore(2, 10, kAround, kAlong))));
  HapticSession session(scene, options);
  // Towards the middle of a facet.
  const Scalar turn = 2 * std::numbers::pi * 5.5 / kAround;
  const Vector3 away(std::cos(turn), std::sin(turn), 0);
  for (int k = 0; k < 300; ++k) {
    session.update(device_at(std::min(1.0, 0.05 * k) * away), kMillisecond);
    EXPECT_NE(session.last().status, HapticStatus::Deadline) << k;
  }
  const Vector3 rest = (kPlay - options.rest_offset) * away;
  EXPECT_LE((session.last().tool.X_WT.translation() - rest).norm(), 0.01 * options.rest_offset);
  EXPECT_LT(session.last().statistics.work, 3000);
}

// A closed prism about z.
testing::MeshArrays shaft(Scalar radius, Scalar half_length, int around, int along) {
  testing::MeshArrays arrays = bore(radius, half_length, around, along);
  for (auto& triangle : arrays.triangles) std::swap(triangle[1], triangle[2]);
  for (const Scalar side : {-1.0, 1.0}) {
    const auto middle = std::int32_t(arrays.vertices.size());
    const std::int32_t first = side < 0 ? 0 : along * around;
    arrays.vertices.emplace_back(0, 0, side * half_length);
    for (std::int32_t i = 0; i < around; ++i) {
      const std::int32_t a = first + i, b = first + (i + 1) % around;
      arrays.triangles.push_back(side < 0 ? std::array{middle, b, a} : std::array{middle, a, b});
    }
  }
  return arrays;
}

// Thousands of pairs of facets are near each other: the search for contacts and the proof of a motion
// do not both fit into a tick.
TEST(WorkLimit, AMeshedShaftInABoreFollowsThoughTicksAreCutOff) {
  for (const int around : {32, 64, 128}) {
    HapticScene scene;
    scene.tool.push_back({testing::shared_mesh(shaft(1.95, 15, around, around / 3)), RigidPose()});
    scene.obstacles.push_back(testing::rigid_tissue(testing::shared_mesh(bore(2, 10, 128, 40))));
    HapticSession session(scene, testing::haptic_options());
    int cut = 0, still = 0;
    for (int k = 0; k < 160; ++k) {
      const Scalar before = session.last().tool.X_WT.translation().z();
      session.update(device_at({0.03, 0.5, 0.02 * std::min(k, 100)}), kMillisecond);
      const Scalar moved = session.last().tool.X_WT.translation().z() - before;
      still = k < 100 && moved < 1e-5 ? still + 1 : 0;
      EXPECT_LT(still, 80) << around << ' ' << k;
      cut += session.last().cutoff.has_value();
    }
    EXPECT_NEAR(session.last().tool.X_WT.translation().z(), 2, 0.01) << around;
    EXPECT_GT(cut, 20) << around;
  }
}

TEST(WorkLimit, RefusesTooLittle) {
  const Jumps jumps(9);
  const std::string message =
      testing::message_of([&] { HapticSession(jumps.scene, jumps.options); });
  EXPECT_NE(message.find("max_work must be >= 10, not 9"), std::string::npos) << message;
}

}  // namespace
}  // namespace dyop
