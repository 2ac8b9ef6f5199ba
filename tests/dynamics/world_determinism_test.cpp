// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world.h"
#include "dyop/dynamics/world_options.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::message_of;
using namespace testing;

// Everything a run produced, as bytes.
std::string bytes_of(World& world, int steps) {
  std::string bytes;
  const auto add = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (int k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(0.01);
    EXPECT_EQ(report.status, AdvanceStatus::Completed);
    for (const ImpactEvent& event : report.impacts) {
      add(event.t);
      for (const WorldContact& contact : event.contacts) add(contact.impulse_W);
    }
  }
  for (const BodyId id : world.bodies()) {
    add(world.state(id).X_WB.rotation());
    add(world.state(id).X_WB.translation());
    add(world.state(id).twist.v_WB);
  }
  return bytes;
}

World tumbling_world(int thread_count) {
  WorldOptions options = earth_options();
  options.thread_count = thread_count;
  World world(options);
  world.add_body(floor_body(0.4, 0.4));
  for (int i = 0; i < 8; ++i) {
    world.add_body(dynamic_body("box", std::make_shared<Box>(Vector3(0.3, 0.2, 0.25)),
                                {0.7 * (i % 4), 0.05 * i, 1 + 0.8 * (i / 2)}, {0, 0, 0},
                                {1.0 * i, 2, 3}));
  }
  return world;
}

TEST(WorldDeterminism, GivesTheSameBytesForEveryNumberOfThreads) {
  World one = tumbling_world(1);
  const std::string expected = bytes_of(one, 80);
  for (const int thread_count : {2, 4, 0}) {
    World world = tumbling_world(thread_count);
    EXPECT_EQ(bytes_of(world, 80), expected);
  }
}

// One island of more pairs and contacts than one thread takes at a time, flat and curved.
World crowded_world(int thread_count) {
  WorldOptions options = earth_options();
  options.thread_count = thread_count;
  World world(options);
  world.add_body(floor_body(0.4, 0));
  const auto brick = std::make_shared<Box>(Vector3(0.5, 0.5, 0.25));
  const Scalar gap = rest_gap(brick->bounding_radius());
  constexpr int kLength = 14;
  constexpr int kHeight = 9;
  const auto place = [&](int i, int k) {
    return Vector3(1.01 * (k + 0.5 * (i % 2)), 0, 0.25 + gap + i * (0.5 + gap));
  };
  for (int i = 0; i < kHeight * kLength; ++i) {
    world.add_body(dynamic_body("brick", brick, place(i / kLength, i % kLength)));
  }
  const auto faceted = std::make_shared<TriangleMesh>(icosphere(1, 0.3).mesh());
  for (int k = 0; k < kLength; ++k) {
    const Vector3 p = place(kHeight, k) + Vector3(0.3 * k, 0, 0.1);
    if (k % 5 == 1) {
      world.add_body(dynamic_body("faceted", faceted, p, {0.3, 0, -2}));
    } else {
      world.add_body(dynamic_body("ball", std::make_shared<Sphere>(0.3), p, {0.3, 0, -2}));
    }
  }
  return world;
}

TEST(WorldDeterminism, SharesOneLargeIslandAmongThreadsWithTheSameBytes) {
  World one = crowded_world(1);
  const std::string fall = bytes_of(one, 3);
  const AdvanceReport first = one.advance(0.01);
  ASSERT_GT(first.work.contacts, 512);
  ASSERT_GT(first.toi.node_pairs, 0);
  const std::string expected = bytes_of(one, 2);
  for (const int thread_count : {2, 4}) {
    World world = crowded_world(thread_count);
    EXPECT_EQ(bytes_of(world, 3), fall);
    const AdvanceReport report = world.advance(0.01);
    EXPECT_EQ(report.work.rounds, first.work.rounds);
    EXPECT_EQ(report.toi.node_pairs, first.toi.node_pairs);
    EXPECT_EQ(report.toi.peak_queue, first.toi.peak_queue);
    EXPECT_EQ(bytes_of(world, 2), expected);
  }
}

TEST(WorldDeterminism, GoesOnFromASnapshotWithTheSameBytes) {
  World world = tumbling_world(2);
  bytes_of(world, 40);
  const WorldSnapshot snapshot = world.snapshot();
  const std::string first = bytes_of(world, 60);
  world.restore(snapshot);
  EXPECT_NEAR(world.time(), 0.4, 1e-12);
  EXPECT_EQ(bytes_of(world, 60), first);
  World other;
  EXPECT_NE(message_of([&] { other.restore(snapshot); }).find("another World"), std::string::npos);
}

}  // namespace
}  // namespace dyop
