// SPDX-License-Identifier: BSD-3-Clause

// The oracle of tool_soak, where a mesh takes over at the very end of a tick.

#include "tool_soak/tick_check.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "support/inputs/haptic_scenes.h"

namespace dyop::testing {
namespace {

constexpr Scalar kTakesOver = 0.4 * kMillisecond;

// A ball of radius 2 is pressed on a sheet. In the last tick another mesh takes over, at a height
// over the sheet, where the tick ends.
struct LastTick {
  explicit LastTick(Scalar margin) : mesh(sheet(30, 12)), scene(ball_tool(2, {0.3, 0.2, 2.6})) {
    scene.obstacles.push_back(deforming_tissue(mesh));
    scene.obstacles[0].margin = margin;
    session = std::make_unique<HapticSession>(scene, haptic_options());
    check = std::make_unique<TickCheck>(scene, haptic_options(), 0);
    for (int k = 0; k < 30; ++k) tick(kMillisecond);
  }
  std::vector<Vector3> raised(Scalar height) const {
    std::vector<Vector3> places = mesh.vertices;
    for (Vector3& p : places) p.z() += height;
    return places;
  }
  // Of a tick that is cut off after the last motion of the old mesh.
  void end_by_motion(Scalar height, Scalar told) {
    ASSERT_TRUE(session->give_snapshot(0, mesh.vertices, kTakesOver));
    check->tissue(0).give(mesh.vertices, kTakesOver);
    tick(0);
    give_mesh(height, told);
    tick(kMillisecond, TickCutoff{20, 0});
  }
  // Of a tick without motion.
  void end_at_rest(Scalar height, Scalar told) {
    give_mesh(height, told);
    tick(0);
    ASSERT_EQ(session->last().path.size(), 1U);
  }
  // The oracle may be told something else.
  void give_mesh(Scalar height, Scalar told) {
    ASSERT_TRUE(session->give_mesh(0, raised(height), mesh.triangles));
    check->tissue(0).give_mesh(raised(told), mesh.triangles);
    ASSERT_EQ(check->findings.broken(), 0);
  }
  void tick(Scalar dt, const std::optional<TickCutoff>& cutoff = std::nullopt) {
    const DevicePose device = device_at({0.3, 0.2, 1});
    session->replay(device, dt, cutoff);
    check->check(*session, device, dt, {});
  }
  HapticStatus status() const { return session->last().status; }
  // No motion has seen the new mesh.
  bool is_ended_early() const { return session->last().path.back().time <= kTakesOver; }

  MeshArrays mesh;
  HapticScene scene;
  std::unique_ptr<HapticSession> session;
  std::unique_ptr<TickCheck> check;
};

const auto kEnds = {&LastTick::end_by_motion, &LastTick::end_at_rest};

TEST(TickCheck, AMeshThatTakesOverAtTheEndMayCrossTheTool) {
  for (const auto end : kEnds) {
    LastTick last(0);
    (last.*end)(1.5, 1.5);
    EXPECT_TRUE(last.is_ended_early());
    EXPECT_EQ(last.status(), HapticStatus::Overlapping);
    EXPECT_EQ(last.check->findings.broken(), 0);
  }
}

TEST(TickCheck, AMeshThatTakesOverAtTheEndMayBeWithinTheMargin) {
  for (const auto end : kEnds) {
    LastTick last(0.5);
    (last.*end)(0.3, 0.3);
    EXPECT_TRUE(last.is_ended_early());
    EXPECT_EQ(last.status(), HapticStatus::Recovering);
    EXPECT_EQ(last.check->findings.broken(), 0);
  }
}

TEST(TickCheck, ReportsAboutAnotherMeshAreFound) {
  for (const auto end : kEnds) {
    LastTick untold(0);
    (untold.*end)(0, 1.5);
    EXPECT_EQ(untold.check->findings.wrong_clearances, 1);
    EXPECT_EQ(untold.check->findings.wrong_tissue, 1);
    EXPECT_EQ(untold.check->findings.breaches, 0);
    LastTick wrong(0);
    (wrong.*end)(1.5, 0);
    EXPECT_EQ(wrong.check->findings.wrong_clearances, 1);
    EXPECT_EQ(wrong.check->findings.wrong_tissue, 1);
    EXPECT_EQ(wrong.check->findings.wrong_statuses, 1);
  }
}

TEST(TickCheck, AMeshWithinTheMarginMustBeTold) {
  for (const auto end : kEnds) {
    LastTick untold(0.5);
    (untold.*end)(0, 0.3);
    EXPECT_EQ(untold.check->findings.breaches, 1);
  }
}

}  // namespace
}  // namespace dyop::testing
