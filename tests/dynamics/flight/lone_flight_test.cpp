// SPDX-License-Identifier: BSD-3-Clause

// Bodies in free flight that are near nothing take a short way through a step.
#include <gtest/gtest.h>

#include <memory>

#include "support/allocation_count.h"
#include "support/inputs/world_scenes.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using namespace testing;

// A box that flies along a plate, so fast that it might reach it, if there is one.
World flying_box(bool has_plate, bool has_wrench) {
  World world(earth_options());
  const auto shape = std::make_shared<Box>(Vector3(0.3, 0.2, 0.1));
  BodyDefinition box = dynamic_body("box", shape, {0, 0, 0.17}, {5, 0, 2}, {1, 2, 3});
  if (has_wrench) {
    box.wrench = [](Scalar t, const MotionState& state) {
      return Wrench{-state.twist.v_WB, Vector3(t, 1, 0)};
    };
  }
  world.add_body(box);
  if (has_plate) world.add_body(floor_body(0.5));
  return world;
}

TEST(LoneFlight, IsTheFlightOfABodyWithPairsToTheBit) {
  for (const bool has_wrench : {false, true}) {
    World alone = flying_box(false, has_wrench);
    World near = flying_box(true, has_wrench);
    std::int64_t pairs = 0;
    for (int i = 0; i < 20; ++i) {
      const AdvanceReport report = alone.advance(0.01);
      const AdvanceReport report_near = near.advance(0.01);
      ASSERT_EQ(report.status, AdvanceStatus::Completed);
      ASSERT_EQ(report_near.status, AdvanceStatus::Completed);
      EXPECT_EQ(report.work.substeps, 1);
      EXPECT_EQ(report_near.work.substeps, 1);
      EXPECT_EQ(report.integrator.steps, report_near.integrator.steps);
      pairs += report_near.work.pairs_by_bound + report_near.work.pairs_by_query;
      const MotionState state = alone.state(alone.bodies().front());
      const MotionState state_near = near.state(near.bodies().front());
      EXPECT_TRUE(has_same_bits(state.X_WB, state_near.X_WB)) << "step " << i;
      EXPECT_TRUE(has_same_bits(state.twist.v_WB, state_near.twist.v_WB)) << "step " << i;
      EXPECT_TRUE(has_same_bits(state.twist.w_WB, state_near.twist.w_WB)) << "step " << i;
    }
    EXPECT_GT(pairs, 0);
  }
}

TEST(LoneFlight, EndsWhereTheCallerWantsIt) {
  World world = flying_box(false, false);
  AdvanceLimits limits;
  std::stop_source stop;
  limits.stop = stop.get_token();
  EXPECT_EQ(world.advance(0.01, limits).status, AdvanceStatus::Completed);
  stop.request_stop();
  EXPECT_EQ(world.advance(0.01, limits).status, AdvanceStatus::Cancelled);
  EXPECT_EQ(world.time(), 0.01);
}

// The short way needs no memory of its own; each piece of a path, which serves several steps, does.
TEST(LoneFlight, HardlyAllocates) {
  constexpr int kBodies = 300;
  constexpr int kSteps = 50;
  WorldOptions options;
  options.gravity_W.setZero();
  options.thread_count = 1;
  options.records_motions = false;
  World world(options);
  add_free_bodies(world, kBodies);
  for (int i = 0; i < 20; ++i) world.advance(0.01);
  const std::int64_t before = allocation_count();
  for (int i = 0; i < kSteps; ++i) world.advance(0.01);
  EXPECT_LT(allocation_count() - before, kBodies * kSteps);
}

}  // namespace
}  // namespace dyop
