// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/haptic_observer.h"

#include <gtest/gtest.h>

#include <string>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::kMillisecond;

// Writes down what it is told.
class Diary final : public HapticObserver {
 public:
  std::string words;
  std::vector<Vector3> vertices;  // of the last snapshot

  void on_tissue(const TissueInput& input) noexcept override {
    words += input.is_retarget ? "retarget " : input.triangles.empty() ? "snapshot " : "mesh ";
    words += std::to_string(input.snapshot) + ' ';
    vertices.assign(input.vertices.begin(), input.vertices.end());
  }
  void on_coupling(std::size_t tool, const CouplingOptions& coupling) noexcept override {
    words += "springs " + std::to_string(tool) + (coupling.bounds_energy ? " bounded " : " free ");
  }
  void on_reset(std::size_t tool, const ToolPose& /*pose*/) noexcept override {
    words += "reset " + std::to_string(tool) + ' ';
  }
  void on_tick(std::span<const DevicePose> devices, Scalar /*dt*/,
               std::span<const HapticTick> ticks) noexcept override {
    words += "tick " + std::to_string(devices.size()) + ' ' +
             std::to_string(ticks[0].inputs[0].given) + ' ';
  }
};

HapticScene ball_over_sheet() {
  HapticScene scene = testing::ball_tool(2, {0, 0, 4});
  scene.obstacles.push_back(testing::deforming_tissue(testing::sheet(20, 4)));
  return scene;
}

std::vector<Vector3> lifted(const HapticSession& session, Scalar z) {
  std::vector<Vector3> vertices = session.scene().obstacles[0].vertices;
  for (Vector3& p : vertices) p.z() += z;
  return vertices;
}

TEST(HapticObserver, IsToldOfEverythingThatASessionTakesInItsOrder) {
  HapticSession session(ball_over_sheet(), testing::haptic_options());
  const auto diary = std::make_shared<Diary>();
  session.observe(diary);
  EXPECT_EQ(session.observer(), diary);
  const auto update = [&] { session.update(testing::device_at({0, 0, 4}), kMillisecond); };
  EXPECT_TRUE(session.give_snapshot(0, lifted(session, 0.5), 0.01));
  EXPECT_FALSE(session.give_snapshot(0, lifted(session, 0.6), 0.01));
  update();
  EXPECT_TRUE(session.give_snapshot(0, lifted(session, 0.7), 0.01));
  update();
  EXPECT_TRUE(session.retarget(0, lifted(session, -0.5), 0.01));
  EXPECT_EQ(diary->vertices, lifted(session, -0.5));
  update();
  session.set_coupling(testing::haptic_options().coupling);
  session.reset({RigidPose(Vector3(0, 0, 5)), {}});
  EXPECT_THROW(session.reset({}, 1), InvalidArgument);
  EXPECT_THROW(session.retarget(0, {}, 0.01), InvalidArgument);
  update();
  EXPECT_TRUE(session.give_mesh(0, lifted(session, -0.5), session.scene().obstacles[0].triangles));
  EXPECT_EQ(diary->words,
            "snapshot 1 tick 1 1 snapshot 2 tick 1 2 retarget 2 tick 1 3 springs 0 free reset 0 "
            "tick 1 0 mesh 3 ");
  session.observe(nullptr);
  diary->words.clear();
  update();
  EXPECT_TRUE(diary->words.empty());
}

TEST(HapticObserver, IsTakenFromTheStartOnly) {
  const auto is_refused = [](const auto& use) {
    HapticSession session(ball_over_sheet(), testing::haptic_options());
    use(session);
    try {
      session.observe(std::make_shared<Diary>());
    } catch (const InvalidArgument&) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(is_refused([](HapticSession&) {}));
  EXPECT_TRUE(is_refused([](HapticSession& s) { s.update(DevicePose(), kMillisecond); }));
  EXPECT_TRUE(is_refused([](HapticSession& s) { s.give_snapshot(0, lifted(s, 1), 0.01); }));
  EXPECT_TRUE(is_refused([](HapticSession& s) { s.set_coupling(s.options().coupling); }));
  EXPECT_TRUE(is_refused([](HapticSession& s) { s.reset({}); }));
}

// Otherwise tissue would stand where it was told to turn.
TEST(HapticObserver, ARetargetWithAnotherNumberOfVerticesChangesNothing) {
  HapticSession session(ball_over_sheet(), testing::haptic_options());
  session.give_snapshot(0, lifted(session, 0.5), 0.004);
  const auto update = [&] { session.update(testing::device_at({0, 0, 4}), kMillisecond); };
  update();
  EXPECT_THROW(session.retarget(0, std::vector<Vector3>(3, Vector3::Zero()), 0.01),
               InvalidArgument);
  for (int k = 0; k < 5; ++k) update();
  EXPECT_EQ(session.last().progress[0].fraction, 1);
  EXPECT_EQ(session.last().inputs[0], (ObstacleInput{1, 1, 0}));
}

// With a tick in which nothing could be proven of it.
TEST(HapticObserver, AMeshThatAppearsInTheToolIsSaidToCrossIt) {
  HapticSession session(ball_over_sheet(), testing::haptic_options());
  session.update(testing::device_at({0, 0, 4}), kMillisecond);
  session.give_mesh(0, lifted(session, 4), session.scene().obstacles[0].triangles);
  EXPECT_EQ(session.update(testing::device_at({0, 0, 4}), 0).status, HapticStatus::Overlapping);
}

}  // namespace
}  // namespace dyop
