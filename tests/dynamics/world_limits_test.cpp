// SPDX-License-Identifier: BSD-3-Clause

// What ends an advance before its end, and bodies that begin where they cannot be.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <numbers>

#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;
using Clock = std::chrono::steady_clock;

TEST(WorldLimits, EndsAfterSoManySteps) {
  WorldOptions options = earth_options();
  options.max_step = 0.01;
  World world(options);
  world.add_body(floor_body(0.5));
  world.add_body(resting_cube(0, 0, 1));
  AdvanceLimits limits;
  limits.max_steps = 3;
  const AdvanceReport report = world.advance(0.1, limits);
  EXPECT_EQ(report.status, AdvanceStatus::BudgetExhausted);
  EXPECT_EQ(report.work.steps, 3);
  EXPECT_NEAR(world.time(), 0.03, 1e-12);
  EXPECT_EQ(world.advance(0.1 - world.time()).status, AdvanceStatus::Completed);
  limits.max_steps = 0;
  EXPECT_THROW(world.advance(0.1, limits), InvalidArgument);
}

// A pile that takes long: the deadline ends it, time after time; what is committed is safe, and the
// run goes on from there.
TEST(WorldLimits, EndsWithinAStepAtItsDeadline) {
  WorldOptions options = earth_options();
  options.thread_count = 1;
  World world(options);
  add_pile(world, 4);
  for (int k = 0; k < 40; ++k) world.advance(0.01);
  AdvanceLimits limits;
  limits.deadline = Clock::now();
  const Scalar before = world.time();
  AdvanceReport report = world.advance(0.01, limits);
  EXPECT_EQ(report.status, AdvanceStatus::BudgetExhausted);
  EXPECT_EQ(world.time(), before);
  int cut = 0;
  for (int micro = 50; micro < 100'000 && world.time() < before + 0.05; micro *= 2) {
    limits.deadline = Clock::now() + std::chrono::microseconds(micro);
    const Scalar t = world.time();
    report = world.advance(0.05, limits);
    EXPECT_GE(world.time(), t);
    EXPECT_EQ(report.t, world.time());
    if (report.status == AdvanceStatus::BudgetExhausted) ++cut;
    for (const CommittedStep& step : report.steps) EXPECT_LE(step.interval.end, world.time());
  }
  EXPECT_GT(cut, 0);
  report = world.advance(0.05);
  EXPECT_EQ(report.status, AdvanceStatus::Completed);
  EXPECT_TRUE(report.too_near.empty());
}

TEST(WorldLimits, TellsWhereTimeGoesIfAsked) {
  WorldOptions options = earth_options();
  options.measures_time = true;
  options.thread_count = 1;
  World world(options);
  add_pile(world, 2);
  StepTimes sum;
  for (int k = 0; k < 80; ++k) {
    const AdvanceReport report = world.advance(0.01);
    const StepTimes& times = report.times;
    sum.broad_phase += times.broad_phase;
    sum.flight += times.flight;
    sum.contacts += times.contacts;
    sum.solve += times.solve;
    sum.ends += times.ends;
    sum.proofs += times.proofs;
    EXPECT_LE(
        times.broad_phase + times.flight + times.contacts + times.solve + times.ends + times.proofs,
        times.total);
  }
  for (const Scalar part :
       {sum.broad_phase, sum.flight, sum.contacts, sum.solve, sum.ends, sum.proofs}) {
    EXPECT_GT(part, 0);
  }
  options.measures_time = false;
  World silent(options);
  add_pile(silent, 1);
  EXPECT_EQ(silent.advance(0.01).times.total, 0);
}

// Two bodies that overlap, alone in space: they separate, not faster than asked for, are reported
// once, and then keep their distance.
void expect_separation(const std::shared_ptr<const Shape>& a, const RigidPose& X_WA,
                       const std::shared_ptr<const Shape>& b, const RigidPose& X_WB,
                       BodyKind kind_of_b = BodyKind::Dynamic) {
  WorldOptions options;
  options.separation_speed = 0.5;
  World world(options);
  BodyDefinition first = dynamic_body("first", a, {0, 0, 0});
  first.initial.X_WB = X_WA;
  BodyDefinition second = dynamic_body("second", b, {0, 0, 0});
  second.initial.X_WB = X_WB;
  second.kind = kind_of_b;
  const BodyId id_a = world.add_body(first);
  const BodyId id_b = world.add_body(second);
  const BodyId other =
      world.add_body(dynamic_body("other", std::make_shared<Sphere>(0.2), {20, 0, 0}, {1, 0, 0}));
  ASSERT_LE(distance(*a, X_WA, *b, X_WB).lower, 0);
  int reported = 0;
  int steps_apart = 0;
  for (int k = 0; k < 300; ++k) {
    const Vector3 p = world.state(id_b).X_WB.translation() - world.state(id_a).X_WB.translation();
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    reported += int(report.too_near.size());
    const Vector3 q = world.state(id_b).X_WB.translation() - world.state(id_a).X_WB.translation();
    EXPECT_LT((q - p).norm(), 0.01 * 3 * *options.separation_speed) << "step " << k;
    const DistanceResult d = distance(*a, world.state(id_a).X_WB, *b, world.state(id_b).X_WB);
    const Scalar target = 1e-4 * std::min(a->bounding_radius(), b->bounding_radius());
    if (d.upper >= target) ++steps_apart;
    if (steps_apart > 5) {
      EXPECT_GE(d.upper, target) << "step " << k;
    }
  }
  EXPECT_EQ(reported, 1);
  EXPECT_GT(steps_apart, 100);
  if (kind_of_b == BodyKind::Dynamic) {
    EXPECT_LT(world.momentum().y(), 1e-9);
  }
  // What pushed them apart is not kept as velocity.
  EXPECT_LT(world.state(id_a).twist.v_WB.norm(), 0.05);
  EXPECT_LT(world.state(id_b).twist.v_WB.norm(), 0.05);
  EXPECT_NEAR(world.state(other).X_WB.translation().x(), 23, 1e-9);
}

TEST(WorldOverlap, SeparatesConvexBodies) {
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.4, 0.3));
  expect_separation(box, RigidPose(), box,
                    RigidPose(rotation_from_vector(Vector3(0.1, 0.2, 0.3)), Vector3(0.8, 0.1, 0)));
  const auto ball = std::make_shared<Sphere>(0.5);
  expect_separation(box, RigidPose(), ball, RigidPose(Vector3(0.1, 0.05, 0.7)));
  expect_separation(ball, RigidPose(), std::make_shared<Capsule>(0.2, 0.5),
                    RigidPose(Vector3(0.5, 0.2, 0)));
}

TEST(WorldOverlap, SeparatesMeshes) {
  const auto ball = std::make_shared<TriangleMesh>(icosphere(2, 0.5).mesh());
  const auto ring = std::make_shared<TriangleMesh>(torus(0.6, 0.2, 24, 12).mesh());
  expect_separation(ball, RigidPose(), ball, RigidPose(Vector3(0.85, 0.1, 0.2)));
  expect_separation(ring, RigidPose(), ball, RigidPose(Vector3(0.1, 0, 0.4)));
  expect_separation(ring, RigidPose(), std::make_shared<Box>(Vector3(0.2, 0.2, 0.2)),
                    RigidPose(Vector3(0.9, 0.1, 0.05)));
}

using Children = std::vector<CompoundChild>;

std::shared_ptr<const Shape> dumb_bell() {
  const auto end = std::make_shared<Sphere>(0.2);
  const Matrix3 z_along_x = rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0));
  return std::make_shared<CompoundShape>(
      Children{{end, RigidPose(Vector3(-0.5, 0, 0))},
               {std::make_shared<Cylinder>(0.1, 0.5), RigidPose(z_along_x, Vector3::Zero())},
               {end, RigidPose(Vector3(0.5, 0, 0))}});
}

// Where one child is apart from what another one is stuck in.
TEST(WorldOverlap, SeparatesCompounds) {
  const Vector3 along(0.5, 0.1, 0.1);
  const Vector3 across(0.1, 0.5, 0.1);
  const RigidPose above(Vector3(0, 0, 0.2));
  const auto boxes = std::make_shared<CompoundShape>(Children{
      {std::make_shared<Box>(along), RigidPose()}, {std::make_shared<Box>(across), above}});
  const auto meshes = std::make_shared<CompoundShape>(
      Children{{std::make_shared<TriangleMesh>(box_mesh(along).mesh()), RigidPose()},
               {std::make_shared<TriangleMesh>(box_mesh(across).mesh()), above}});
  const auto ball = std::make_shared<Sphere>(0.35);
  const auto box = std::make_shared<Box>(Vector3(0.3, 0.4, 0.35));
  const Matrix3 R = rotation_from_vector(Vector3(0.5, 0, 1.4));
  for (const BodyKind kind : {BodyKind::Dynamic, BodyKind::Static}) {
    for (const auto& cross : {boxes, meshes}) {
      expect_separation(cross, RigidPose(), ball, RigidPose(Vector3(0, 0.15, 0.1)), kind);
      expect_separation(cross, RigidPose(), ball, RigidPose(Vector3(0.25, 0.15, 0.1)), kind);
      expect_separation(cross, RigidPose(), box, RigidPose(R, Vector3(0.25, 0.15, 0.1)), kind);
    }
    expect_separation(dumb_bell(), RigidPose(), box, RigidPose(R, Vector3(0, 0.15, 0.1)), kind);
  }
}

// Where the shortest way out changes as they turn.
TEST(WorldOverlap, SeparatesWhatInterlocks) {
  const auto ring = std::make_shared<TriangleMesh>(torus(0.5, 0.15, 24, 12).mesh());
  const RigidPose X_WA(rotation_from_vector(Vector3(-0.29, -1.94, 1.33)), Vector3::Zero());
  const RigidPose X_AB(rotation_from_vector(Vector3(0.52, 0.97, -1.17)), Vector3(0.2, 0, 0.04));
  expect_separation(dumb_bell(), X_WA, ring, X_WA * X_AB, BodyKind::Static);
}

TEST(WorldOverlap, LiftsABoxOutOfTheFloorWithoutTurningIt) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  BodyDefinition sunk = resting_cube(0, 0, 0);
  sunk.initial.X_WB = RigidPose(Vector3(0, 0, 0.42));
  const BodyId cube = world.add_body(sunk);
  for (int k = 0; k < 200; ++k) {
    ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
  }
  const RigidPose X = world.state(cube).X_WB;
  EXPECT_NEAR(X.translation().z(), 0.5, 2e-3);
  EXPECT_LT(X.translation().head<2>().norm(), 1e-3);
  EXPECT_LT(rotation_vector(X.rotation()).norm(), 1e-3);
}

// It rests, which proves no distance, before it is pushed down: it is told as too near, and the
// bounds of its gap hold throughout.
TEST(WorldOverlap, KnowsTheGapOfABodyThatRestedTooNear) {
  const auto floor = std::make_shared<TriangleMesh>(box_mesh({1, 1, 0.5}).mesh());
  for (const std::shared_ptr<const Shape>& shape : std::vector<std::shared_ptr<const Shape>>{
           std::make_shared<TriangleMesh>(box_mesh({0.2, 0.2, 0.2}).mesh()),
           std::make_shared<Box>(Vector3(0.2, 0.2, 0.2))}) {
    const Scalar target = 1e-4 * shape->bounding_radius();
    World world{WorldOptions{}};
    BodyDefinition ground;
    ground.kind = BodyKind::Static;
    ground.shape = floor;
    const BodyId below = world.add_body(ground);
    const BodyId above = world.add_body(dynamic_body("cube", shape, {0, 0, 0.7 + 0.1 * target}));
    std::size_t reported = 0;
    for (int k = 0; k < 60; ++k) {
      if (k == 5) {
        MotionState state = world.state(above);
        state.twist.v_WB = Vector3(0, 0, -1e-3);
        world.set_state(above, state);
      }
      const AdvanceReport report = world.advance(0.01);
      ASSERT_EQ(report.status, AdvanceStatus::Completed);
      reported += report.too_near.size();
      const DistanceResult d =
          distance(*floor, world.state(below).X_WB, *shape, world.state(above).X_WB);
      for (const PairRecord& pair : world.pairs()) {
        EXPECT_LE(pair.gap_lower, d.upper) << "step " << k;
        EXPECT_GE(pair.gap_upper, d.lower) << "step " << k;
      }
      EXPECT_GT(d.lower, k < 30 ? 0 : target) << "step " << k;
    }
    EXPECT_EQ(reported, 1u);
  }
}

}  // namespace
}  // namespace dyop
