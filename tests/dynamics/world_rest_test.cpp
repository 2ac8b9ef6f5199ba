// SPDX-License-Identifier: BSD-3-Clause

// Rest: what stands neither creeps nor stays awake, and moves again when it has a reason to.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kRestStep = 0.01;

struct RestRun {
  Scalar residual = 0;
  std::int64_t unconverged = 0;
};

RestRun rest(World& world, Scalar time, Scalar h = kRestStep) {
  RestRun run;
  const auto steps = std::lround(time / h);
  for (long k = 0; k < steps; ++k) {
    const AdvanceReport report = world.advance(h);
    EXPECT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_EQ(report.work.stalls, 0);
    run.residual = std::max(run.residual, report.work.residual);
    run.unconverged += report.work.unconverged;
  }
  return run;
}

std::vector<RigidPose> poses(const World& world) {
  std::vector<RigidPose> list;
  for (const BodyId id : world.bodies()) list.push_back(world.state(id).X_WB);
  return list;
}

// The largest displacement of a body, turning included, over its radius.
Scalar largest_creep(const World& world, const std::vector<RigidPose>& before) {
  Scalar largest = 0;
  for (const BodyId id : world.bodies()) {
    const RigidPose& X = world.state(id).X_WB;
    const RigidPose& Y = before[id.slot];
    const Scalar radius = world.body(id).shape->bounding_radius();
    largest = std::max(largest, (X.translation() - Y.translation()).norm() / radius +
                                    (X.rotation() - Y.rotation()).norm());
  }
  return largest;
}

bool are_all_asleep(const World& world) {
  for (const BodyId id : world.bodies()) {
    if (world.body(id).kind == BodyKind::Dynamic && !world.is_asleep(id)) return false;
  }
  return true;
}

WorldOptions sleepless(WorldOptions options) {
  options.sleep_steps = 0;
  options.records_motions = false;
  return options;
}

// A minute, every step solved: nothing but friction holds the cubes against the solver's errors.
TEST(WorldRest, KeepsAStackThatMayNotSleepWithinAMillionthOfItsSize) {
  World world(sleepless(earth_options()));
  add_columns(world, 1, 10);
  const std::vector<RigidPose> before = poses(world);
  const RestRun run = rest(world, 60);
  EXPECT_EQ(run.unconverged, 0);
  EXPECT_LT(run.residual, 1e-6);
  EXPECT_LT(largest_creep(world, before), 1e-6);
}

TEST(WorldRest, KeepsABlockOnASlopeThatMayNotSleepWithinAMillionthOfItsSize) {
  WorldOptions options;
  const Scalar angle = std::atan(0.45);
  options.gravity_W = kGravity * Vector3(std::sin(angle), 0, -std::cos(angle));
  World world(sleepless(options));
  world.add_body(floor_body(0.5));
  world.add_body(resting_cube(0, 0, 0));
  rest(world, 0.1);
  const std::vector<RigidPose> before = poses(world);
  rest(world, 60);
  EXPECT_LT(largest_creep(world, before), 1e-6);
}

// Also after a fall, and whatever the step: cubes on each other, dropped with gaps and turned.
TEST(WorldRest, PutsFallenCubesToSleepAtEveryStep) {
  for (const Scalar h : {0.002, 0.005, 0.01, 0.02}) {
    SCOPED_TRACE(h);
    World world(earth_options());
    world.add_body(floor_body(0.5));
    const auto shape = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
    for (int k = 0; k < 4; ++k) {
      BodyDefinition cube = dynamic_body("cube", shape, {0.01 * (k % 2), 0, 0.52 + 1.02 * k});
      cube.initial.X_WB = RigidPose(rotation_from_vector(Vector3(0.01 * k, 0.005, 0.1 * k)),
                                    cube.initial.X_WB.translation());
      cube.restitution = 0;
      world.add_body(cube);
    }
    rest(world, 4, h);
    EXPECT_TRUE(are_all_asleep(world));
    const std::vector<RigidPose> before = poses(world);
    rest(world, 1, h);
    EXPECT_EQ(largest_creep(world, before), 0);
  }
}

// A block that begins to slide has moved by no more than a millionth of a rest offset in 50 such
// steps.
TEST(WorldRest, PutsNothingToSleepThatBeginsToSlideInShortSteps) {
  for (const Scalar h : {1e-7, 1e-6, 1e-5, 1e-4}) {
    WorldOptions options;
    options.gravity_W = kGravity * Vector3(0.1, 0, -1);
    World world(options);
    world.add_body(floor_body(0));
    const BodyId cube = world.add_body(resting_cube(0, 0, 0));
    rest(world, 1000 * h, h);
    EXPECT_FALSE(world.is_asleep(cube)) << h;
    EXPECT_NEAR(world.state(cube).twist.v_WB.x(), 100 * h * kGravity, 1e-3 * h * kGravity) << h;
  }
}

TEST(WorldRest, PutsWhatRestsToSleepInShortSteps) {
  for (const Scalar h : {5e-5, 2e-4}) {
    World world(earth_options());
    world.add_body(floor_body(0.5));
    const BodyId cube = world.add_body(resting_cube(0, 0, 0));
    rest(world, 0.01, h);
    EXPECT_TRUE(world.is_asleep(cube)) << h;
  }
}

class WorldRestOfTwo : public ::testing::Test {
 protected:
  WorldRestOfTwo() : world_(earth_options()) {
    world_.add_body(floor_body(0.5));
    lower_ = world_.add_body(resting_cube(0, 0, 0));
    upper_ =
        world_.add_body(resting_cube(0.2, 0, world_.state(lower_).X_WB.translation().z() + 0.5));
    rest(world_, 1);
  }
  World world_;
  BodyId lower_, upper_;
};

TEST_F(WorldRestOfTwo, FallsWhenTheBodyBelowIsDisabled) {
  ASSERT_TRUE(world_.is_asleep(upper_));
  world_.set_enabled(lower_, false);
  rest(world_, 0.2);
  EXPECT_NEAR(world_.state(upper_).twist.v_WB.z(), -0.2 * kGravity, 0.02);
}

TEST_F(WorldRestOfTwo, FallsWhenTheBodyBelowIsSetElsewhere) {
  ASSERT_TRUE(world_.is_asleep(upper_));
  MotionState state = world_.state(lower_);
  state.X_WB = RigidPose(state.X_WB.translation() + Vector3(5, 0, 0));
  world_.set_state(lower_, state);
  rest(world_, 0.2);
  EXPECT_NEAR(world_.state(upper_).twist.v_WB.z(), -0.2 * kGravity, 0.02);
  rest(world_, 3);
  EXPECT_TRUE(are_all_asleep(world_));
  EXPECT_NEAR(world_.state(upper_).X_WB.translation().z(), 0.5, 0.002);
}

TEST_F(WorldRestOfTwo, ReportsTheShortestGapAsleepAndOnTheWayToAnotherPlace) {
  const auto expect_shortest = [&](Scalar reported) {
    Scalar shortest = kInfinity;
    for (const PairRecord& pair : world_.pairs()) {
      for (const PairContact& contact : pair.contacts) {
        shortest = std::min(shortest, contact.point.gap);
      }
    }
    EXPECT_EQ(reported, shortest);
  };
  ASSERT_TRUE(are_all_asleep(world_));
  expect_shortest(world_.advance(kRestStep).work.shortest_gap);
  MotionState state = world_.state(upper_);
  state.X_WB = RigidPose(state.X_WB.translation() + Vector3(0.1, 0, 0.0001));
  world_.set_state(upper_, state);
  for (int k = 0; k < 50; ++k) expect_shortest(world_.advance(kRestStep).work.shortest_gap);
}

// A push of the lower one by a force carries the upper one, which slept, along.
TEST_F(WorldRestOfTwo, WakesTogetherWithItsNeighbour) {
  ASSERT_TRUE(world_.is_asleep(upper_));
  const Scalar weight = world_.body(lower_).mass_properties.mass * kGravity;
  world_.set_wrench(lower_, [weight](Scalar, const MotionState&) {
    return Wrench{Vector3(1.2 * weight, 0, 0), Vector3::Zero()};
  });
  rest(world_, 0.5);
  // Both weigh on the floor, where friction takes 0.5 of it: a = (1.2 - 1) g / 2.
  EXPECT_NEAR(world_.state(upper_).twist.v_WB.x(), 0.05 * kGravity, 0.01 * 0.05 * kGravity);
  EXPECT_NEAR(world_.state(lower_).twist.v_WB.x(), 0.05 * kGravity, 0.01 * 0.05 * kGravity);
}

TEST_F(WorldRestOfTwo, WakesWhenItsOwnVelocityIsSet) {
  ASSERT_TRUE(world_.is_asleep(upper_));
  MotionState state = world_.state(upper_);
  state.twist.v_WB = Vector3(0, 0, 2);
  world_.set_state(upper_, state);
  rest(world_, 0.1);
  EXPECT_NEAR(world_.state(upper_).twist.v_WB.z(), 2 - 0.1 * kGravity, 1e-6);
}

struct FarShape {
  std::string name;
  std::shared_ptr<const Shape> shape;
};

// A box whose middle is at p in its shape's frame.
std::vector<FarShape> boxes_at(const Vector3& p) {
  const Vector3 half(0.2, 0.15, 0.1);
  const MeshArrays box = box_mesh(half);
  std::vector<Vector3> vertices;
  for (const Vector3& vertex : box.vertices) vertices.push_back(vertex + p);
  const auto mesh = std::make_shared<TriangleMesh>(vertices, box.triangles);
  const auto part = std::make_shared<Box>(half);
  return {{"hull", std::make_shared<ConvexHull>(vertices)},
          {"mesh", mesh},
          {"compound",
           std::make_shared<CompoundShape>(std::vector<CompoundChild>{{part, RigidPose(p)}})}};
}

// As parts in assembly coordinates: where a frame's origin is says nothing about a body.
TEST(WorldRest, IsAsHighWhereverTheFramesOriginIs) {
  const Scalar rest_gap = 5e-4 * Vector3(0.2, 0.15, 0.1).norm();
  for (const Scalar away : {0.0, 1.0, 10.0, 100.0, 1e6, 1e10}) {
    const Vector3 p(-0.6 * away, 0.8 * away, 0);
    for (const auto& [name, shape] : boxes_at(p)) {
      World world(earth_options());
      world.add_body(floor_body(0.5));
      BodyDefinition body;
      body.shape = shape;
      body.mass_properties = Box(Vector3(0.2, 0.15, 0.1)).compute_mass_properties(1000);
      body.mass_properties.p_BoBcm = p;
      body.friction = 0.5;
      body.initial.X_WB = RigidPose(Vector3(0, 0, 0.2) - p);
      const BodyId id = world.add_body(body);
      AdvanceStatus status = AdvanceStatus::Completed;
      for (int k = 0; k < 100 && status == AdvanceStatus::Completed; ++k) {
        status = world.advance(kRestStep).status;
      }
      const Scalar gap = (world.state(id).X_WB * p).z() - 0.1;
      if (away < 1e10) {
        EXPECT_EQ(status, AdvanceStatus::Completed) << name << ' ' << away;
        EXPECT_NEAR(gap, rest_gap, 0.1 * rest_gap) << name << ' ' << away;
        EXPECT_TRUE(world.is_asleep(id)) << name << ' ' << away;
      } else {  // rounding is larger than the gap
        EXPECT_EQ(status, AdvanceStatus::NumericalLimit) << name;
        EXPECT_GT(gap, rest_gap) << name;
      }
    }
  }
}

}  // namespace
}  // namespace dyop
