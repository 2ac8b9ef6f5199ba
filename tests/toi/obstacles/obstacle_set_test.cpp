// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/obstacle_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "dyop/geometry/primitives.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;  // NOLINT: makers
using testing::at;
using testing::moving;

constexpr TimeInterval kSpan{0, 1};

// A row of balls on the x axis at 3, 4, 5, ..., and the body moving along it.
ObstacleSet row_of_balls(int count) {
  ObstacleSet set;
  const auto ball = std::make_shared<Sphere>(0.25);
  for (int i = 0; i < count; ++i) set.add(ball, at(3 + i, 0, 0), 1u << (i % 2));
  return set;
}

TEST(ObstacleSet, SaysWhoIsHitAndHowMuchIsFree) {
  const ObstacleSet set = row_of_balls(40);
  const Sphere body(0.25);
  const ConstantTwistMotion X_WB = moving(at(0, 0, 0), {10, 0, 0});
  const ObstacleImpact first = set.first_impact(body, X_WB, kSpan);
  ASSERT_EQ(first.toi.status, ToiStatus::Impact);
  EXPECT_EQ(first.obstacle, set.ids()[0]);
  EXPECT_NEAR(first.toi.t_safe, 0.25, 1e-6);
  EXPECT_EQ(first.free_fraction, first.toi.t_safe);
  EXPECT_TRUE(first.toi.contact.has_value());
  EXPECT_NEAR(first.toi.X_WA.translation().x(), 2.5, 1e-5);
  EXPECT_NEAR(first.toi.X_WB.translation().x(), 3, 1e-12);
  ObstacleFilter odd;
  odd.groups = 2;
  EXPECT_EQ(set.first_impact(body, X_WB, kSpan, {}, odd).obstacle, set.ids()[1]);
  odd.groups = 4;
  const ObstacleImpact none = set.first_impact(body, X_WB, kSpan, {}, odd);
  EXPECT_EQ(none.toi.status, ToiStatus::Separated);
  EXPECT_EQ(none.free_fraction, 1);
  EXPECT_FALSE(none.obstacle.has_value());
  EXPECT_EQ(set.nearest(body, at(30.4, 0, 0)).obstacle, set.ids()[27]);
  EXPECT_NEAR(set.nearest(body, at(0, 0, 0)).distance.lower, 2.5, 1e-9);
  const ObstacleClearance aside = set.least_distance(body, moving(at(0, 1, 0), {10, 0, 0}), kSpan);
  EXPECT_NEAR(aside.distance.upper, 0.5, 0.005);
  EXPECT_LE(aside.distance.lower, 0.5);
  EXPECT_GE(aside.distance.lower, 0.49);
}

TEST(ObstacleSet, RaysMeetTheFirstObstacle) {
  ObstacleSet set = row_of_balls(40);
  const ObstacleHit first = set.ray_cast({.radius = 0.25});
  EXPECT_EQ(first.hit.status, RayStatus::Hit);
  EXPECT_EQ(first.obstacle, set.ids()[0]);
  EXPECT_NEAR(first.hit.distance, 2.5, 1e-12);
  ObstacleFilter odd;
  odd.groups = 2;
  EXPECT_NEAR(set.ray_cast({}, 0, odd).hit.distance, 3.75, 1e-12);
  const ObstacleHit back =
      set.ray_cast({.p_W = Vector3(60, 0, 0), .direction_W = -Vector3::UnitX()});
  EXPECT_EQ(back.obstacle, set.ids()[39]);
  const ObstacleHit none = set.ray_cast({.p_W = Vector3(0, 1, 0)});
  EXPECT_EQ(none.hit.status, RayStatus::Miss);
  EXPECT_EQ(none.hit.distance, kInfinity);
  EXPECT_FALSE(none.obstacle.has_value());
  // One that moves is where it is at the time asked for.
  const auto ball = std::make_shared<Sphere>(0.25);
  const ObstacleId moves =
      set.add({ball, std::make_shared<ConstantTwistMotion>(moving(at(0, 9, 0), {0, -9, 0}))});
  EXPECT_EQ(set.ray_cast({.p_W = Vector3(-2, 0, 0)}, 1).obstacle, moves);
  EXPECT_EQ(set.ray_cast({.p_W = Vector3(-2, 0, 0)}, 0).obstacle, set.ids()[0]);
  EXPECT_NE(message_of<InvalidArgument>([&] { set.ray_cast({}, kInfinity); }).find("t must be"),
            std::string::npos);
  EXPECT_NE(message_of<InvalidArgument>([&] { set.ray_cast({.length = -1}); }).find("length"),
            std::string::npos);
}

// Against a loop over all of them: boxes, meshes and balls, thin and thick rays.
TEST(ObstacleSet, RaysAgreeWithALoopOverAll) {
  std::mt19937_64 random(8);
  ObstacleSet set;
  std::vector<std::pair<std::shared_ptr<const Shape>, RigidPose>> all;
  const std::vector<std::shared_ptr<const Shape>> shapes{
      std::make_shared<Sphere>(0.4), std::make_shared<TriangleMesh>(torus(0.6, 0.2, 9, 5).mesh()),
      std::make_shared<TriangleMesh>(box_mesh({0.3, 0.5, 0.2}).mesh())};
  for (int i = 0; i < 120; ++i) {
    all.emplace_back(shapes[std::size_t(i % 3)], random_pose(6, random));
    set.add(all.back().first, all.back().second);
  }
  int hits = 0;
  for (int k = 0; k < 300; ++k) {
    const Ray ray{.p_W = random_vector(9, random),
                  .direction_W = k % 4 == 0 ? Vector3::UnitY() : random_direction(random),
                  .length = k % 5 == 0 ? 6 : kInfinity,
                  .radius = k % 2 == 0 ? 0 : random_number(0, 0.5, random)};
    const ObstacleHit found = set.ray_cast(ray);
    Scalar first = ray.length;
    for (const auto& [shape, X] : all) {
      const RayHit hit = ray_cast(*shape, X, ray);
      if (hit.status != RayStatus::Miss) first = std::min(first, hit.distance);
    }
    EXPECT_EQ(found.hit.distance, first);
    hits += found.obstacle.has_value();
  }
  EXPECT_GT(hits, 30);
  EXPECT_LT(hits, 280);
}

TEST(ObstacleSet, TellsSolidsFromSurfaces) {
  ObstacleSet set;
  const auto shell = std::make_shared<TriangleMesh>(icosphere(2).mesh());
  const auto resting = std::make_shared<RestMotion>();
  const ObstacleId surface = set.add({shell, resting, 1, false});
  const Sphere body(0.1);
  EXPECT_EQ(set.first_impact(body, RestMotion(), kSpan).toi.status, ToiStatus::Separated);
  set.remove(surface);
  const ObstacleId solid = set.add({shell, resting, 1, true});
  EXPECT_NE(solid, surface);
  const ObstacleImpact inside = set.first_impact(body, RestMotion(), kSpan);
  EXPECT_EQ(inside.toi.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(inside.obstacle, solid);
  EXPECT_EQ(inside.free_fraction, 0);
  EXPECT_EQ(set.nearest(body, RigidPose()).distance.status, DistanceStatus::Overlapping);
  EXPECT_EQ(set.least_distance(body, RestMotion(), kSpan).distance.lower, 0);
}

// The smallest id wins among several at the same time or distance.
TEST(ObstacleSet, BreaksTiesById) {
  ObstacleSet set;
  const auto ball = std::make_shared<Sphere>(0.5);
  std::vector<ObstacleId> ids;
  for (int i = 0; i < 60; ++i) ids.push_back(set.add(ball, at(3, 0, 0)));
  const Sphere body(0.5);
  const ConstantTwistMotion X_WB = moving(at(0, 0, 0), {5, 0, 0});
  EXPECT_EQ(set.first_impact(body, X_WB, kSpan).obstacle, ids[0]);
  EXPECT_EQ(set.nearest(body, RigidPose()).obstacle, ids[0]);
  EXPECT_EQ(set.nearest(body, at(3, 0, 0)).obstacle, ids[0]);
  EXPECT_EQ(set.first_impact(body, RestMotion(at(3, 0, 0)), kSpan).obstacle, ids[0]);
  set.remove(ids[0]);
  EXPECT_EQ(set.first_impact(body, X_WB, kSpan).obstacle, ids[1]);
}

// t_safe rises with the budget, never passes the impact, and ends in the same answer.
TEST(ObstacleSet, KeepsToTheBudgetOfTheWholeCall) {
  ObstacleSet set;
  const auto mesh = std::make_shared<TriangleMesh>(torus(0.4, 0.15, 24, 12).mesh());
  for (int i = 0; i < 60; ++i) {
    set.add(mesh, RigidPose(rotation_from_vector(Vector3(i, 1, 0)),
                            Vector3(1.0 + 0.15 * i, i % 2 == 0 ? 1.0 : -1.0, 0.1)));
  }
  set.add(mesh, at(9.5, 0, 0));
  const TriangleMesh body = gear(8, 0.3, 0.4, 0.2).mesh();
  const ConstantTwistMotion X_WB = moving(at(-0.5, 0, 0), {10.5, 0, 0}, {5, 3, 1});
  const ObstacleImpact whole = set.first_impact(body, X_WB, kSpan);
  ASSERT_EQ(whole.toi.status, ToiStatus::Impact);
  Scalar before = 0;
  int exhausted = 0;
  ObstacleWorkspace workspace;
  ToiOptions options;
  for (std::int64_t budget = 1; budget < 2 * whole.toi.statistics.node_pairs;
       budget = 1 + budget * 5 / 4) {
    options.max_node_pairs = budget;
    const ObstacleImpact found = set.first_impact(body, X_WB, kSpan, options, {}, workspace);
    EXPECT_LE(found.toi.statistics.node_pairs, budget);
    EXPECT_LE(found.toi.t_safe, whole.toi.t_safe);
    ASSERT_TRUE(found.obstacle.has_value());
    if (found.toi.status == ToiStatus::BudgetExhausted) {
      ++exhausted;
      EXPECT_FALSE(found.toi.contact.has_value());
      before = std::max(before, found.toi.t_safe);
    } else {
      EXPECT_EQ(found.toi.t_safe, whole.toi.t_safe);
      EXPECT_EQ(found.obstacle, whole.obstacle);
    }
  }
  EXPECT_GT(exhausted, 5);
  EXPECT_GT(before, 0.3);
  options = {};
  options.deadline = std::chrono::steady_clock::now();
  EXPECT_EQ(set.first_impact(body, X_WB, kSpan, options).toi.status, ToiStatus::BudgetExhausted);
  std::stop_source stop;
  stop.request_stop();
  options = {};
  options.stop = stop.get_token();
  EXPECT_EQ(set.first_impact(body, X_WB, kSpan, options).toi.status, ToiStatus::Cancelled);
}

TEST(ObstacleSet, AnswersFromSeveralThreads) {
  const ObstacleSet set = row_of_balls(100);
  const Sphere body(0.25);
  std::vector<Scalar> times(8);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < times.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int k = 0; k < 50; ++k) {
        times[i] = set.first_impact(body, moving(at(0, 0, 0), {10, 0, 0}), kSpan).toi.t_safe;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Scalar t : times) EXPECT_EQ(t, times[0]);
}

TEST(ObstacleSet, KnowsItsMembers) {
  ObstacleSet set;
  const auto ball = std::make_shared<Sphere>(1);
  const ObstacleId first = set.add(ball, at(1, 0, 0));
  const ObstacleId second = set.add(ball, at(2, 0, 0), 8);
  EXPECT_EQ(set.size(), 2u);
  EXPECT_EQ(set.ids(), (std::vector<ObstacleId>{first, second}));
  EXPECT_EQ(set.obstacle(second).groups, 8u);
  set.remove(first);
  EXPECT_FALSE(set.contains(first));
  const ObstacleId third = set.add(ball, at(3, 0, 0));
  EXPECT_NE(third, first);
  EXPECT_EQ(set.size(), 2u);
  set.move(third, at(4, 0, 0));
  EXPECT_EQ(set.obstacle(third).X_WO->pose(0).translation().x(), 4);
}

TEST(ObstacleSet, RefusesInvalidInputByName) {
  ObstacleSet set;
  const auto ball = std::make_shared<Sphere>(1);
  const auto sheet = std::make_shared<TriangleMesh>(plate_grid(1, 1, 1, 1).mesh());
  const auto resting = std::make_shared<RestMotion>();
  EXPECT_NE(testing::message_of([&] {
              set.add({nullptr, resting, 1, false});
            }).find("shape"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] {
              set.add({ball, nullptr, 1, false});
            }).find("motion"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] {
              set.add({sheet, resting, 1, true});
            }).find("not closed"),
            std::string::npos);
  const ObstacleId id = set.add(ball, RigidPose());
  set.remove(id);
  EXPECT_NE(testing::message_of([&] { set.remove(id); }).find("id 0"), std::string::npos);
  EXPECT_NE(testing::message_of([&] { set.move(id, RigidPose()); }).find("id 0"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] { set.obstacle(id); }).find("id 0"), std::string::npos);
  ToiOptions solid;
  solid.solid_b = true;
  EXPECT_NE(
      testing::message_of([&] { set.first_impact(*ball, *resting, kSpan, solid); }).find("solid_b"),
      std::string::npos);
  testing::Random random(1);
  const auto brief = testing::hermite(random, {1, 1, 1, {0, 0.5}});
  set.add({ball, brief, 1, false});
  const auto expect_domain = [](const std::string& message) {
    EXPECT_NE(message.find("the motion of an obstacle is defined only on [0, 0.5]"),
              std::string::npos)
        << message;
  };
  expect_domain(testing::message_of([&] { set.first_impact(*ball, *resting, kSpan); }));
  expect_domain(testing::message_of([&] { set.nearest(*ball, RigidPose(), 0.7); }));
  expect_domain(testing::message_of([&] { set.least_distance(*ball, *resting, kSpan); }));
}

TEST(ObstacleSet, ACopyKeepsIds) {
  ObstacleSet set;
  const auto ball = std::make_shared<Sphere>(1);
  std::vector<ObstacleId> ids;
  for (int k = 0; k < 6; ++k) ids.push_back(set.add(ball, RigidPose(Vector3(3 * k, 0, 0))));
  set.remove(ids[1]);
  set.remove(ids[4]);
  ids.push_back(set.add(ball, RigidPose(Vector3(0, 5, 0))));
  ObstacleSet copy;
  for (const ObstacleId id : set.ids()) copy.add_as(id, set.obstacle(id));
  EXPECT_EQ(copy.ids(), set.ids());
  EXPECT_EQ(copy.size(), set.size());
  for (const ObstacleId id : set.ids()) {
    EXPECT_EQ(copy.obstacle(id).X_WO, set.obstacle(id).X_WO);
    const RigidPose beside(copy.obstacle(id).X_WO->pose(0).translation() + Vector3(0, 0, 2.5));
    EXPECT_EQ(copy.nearest(*ball, beside).obstacle, id);
  }
  EXPECT_FALSE(set.contains(copy.add(ball, RigidPose())));
  const ObstacleId taken = set.ids().front();
  EXPECT_THROW(copy.add_as(taken, set.obstacle(taken)), InvalidArgument);
  EXPECT_THROW(copy.add_as(ObstacleId{0xffffffffu}, set.obstacle(taken)), InvalidArgument);
  EXPECT_THROW(copy.add_as(ObstacleId{77}, {}), InvalidArgument);
}

}  // namespace
}  // namespace dyop
