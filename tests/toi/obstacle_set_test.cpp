// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/obstacle_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <thread>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/sphere.h"
#include "geometry/all_compounds.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace test_support;  // NOLINT: makers
using testing::at;
using testing::kAllMotions;
using testing::MotionPointer;
using testing::moving;
using testing::Scales;

constexpr TimeInterval kSpan{0, 1};

std::vector<std::shared_ptr<const Shape>> small_shapes(Scalar size) {
  std::vector<std::shared_ptr<const Shape>> shapes;
  for (const ShapeMaker& maker : all_shapes()) shapes.push_back(maker.make(0.3 * size));
  for (const CompoundMaker& maker : all_compounds()) shapes.push_back(maker.make(0.4 * size));
  shapes.push_back(std::make_shared<TriangleMesh>(
      gear(5, 0.8, 1, 0.2).moved(Matrix3::Identity(), Vector3::Zero(), 0.4 * size).mesh()));
  return shapes;
}

// A set and the same as a plain list.
struct RandomScene {
  ObstacleSet set;
  std::map<ObstacleId, Obstacle> list;
  std::shared_ptr<const Shape> body;
  MotionPointer X_WB;
};

RandomScene make_scene(testing::Random& random,
                       const std::vector<std::shared_ptr<const Shape>>& shapes, int count,
                       Scalar size) {
  RandomScene scene;
  const auto pick = [&](std::size_t n) {
    return std::min(std::size_t(random.uniform(0, Scalar(n))), n - 1);
  };
  const Scales scales{4 * size, 4 * size, 3, kSpan};
  const auto random_motion = [&]() -> MotionPointer {
    if (random.uniform(0, 1) < 0.8) return testing::rest(random, scales);
    return kAllMotions[pick(kAllMotions.size())].make(random, scales);
  };
  for (int i = 0; i < count; ++i) {
    const Obstacle obstacle{shapes[pick(shapes.size())], random_motion(), 1u << unsigned(pick(3)),
                            false};
    const ObstacleId id = scene.set.add(obstacle);
    scene.list[id] = obstacle;
    // Some leave or go elsewhere.
    if (random.uniform(0, 1) < 0.2) {
      auto other = scene.list.begin();
      std::advance(other, std::ptrdiff_t(pick(scene.list.size())));
      if (random.uniform(0, 1) < 0.5) {
        scene.set.remove(other->first);
        scene.list.erase(other);
      } else {
        other->second.X_WO = random_motion();
        scene.set.move(other->first, other->second.X_WO);
      }
    }
  }
  scene.body = shapes[pick(shapes.size())];
  scene.X_WB = kAllMotions[pick(kAllMotions.size())].make(random, scales);
  return scene;
}

ObstacleFilter some_groups(testing::Random& random) {
  ObstacleFilter filter;
  filter.groups = random.uniform(0, 1) < 0.5 ? 5u : 7u;
  if (random.uniform(0, 1) < 0.3) {
    filter.accepts = [](ObstacleId id) { return static_cast<std::uint64_t>(id) % 4 != 1; };
  }
  return filter;
}

bool is_wanted(const std::pair<const ObstacleId, Obstacle>& entry, const ObstacleFilter& filter) {
  return (entry.second.groups & filter.groups) != 0 &&
         (!filter.accepts || filter.accepts(entry.first));
}

// What a user's loop over all obstacles finds.
ToiResult first_of_loop(const RandomScene& scene, const ToiOptions& options,
                        const ObstacleFilter& filter) {
  ToiResult first;
  first.status = ToiStatus::Separated;
  first.t_safe = kSpan.end;
  for (const auto& entry : scene.list) {
    if (!is_wanted(entry, filter)) continue;
    const ToiResult found = time_of_impact(*scene.body, *scene.X_WB, *entry.second.shape,
                                           *entry.second.X_WO, kSpan, options);
    if (found.status == ToiStatus::Separated) continue;
    if (first.status == ToiStatus::InitiallyWithinTarget) continue;
    if (found.status == ToiStatus::InitiallyWithinTarget || found.t_safe < first.t_safe ||
        first.status == ToiStatus::Separated) {
      first = found;
    }
  }
  return first;
}

TEST(ObstacleSet, FirstImpactIsThatOfTheLoop) {
  testing::Random random(31);
  std::map<ToiStatus, int> seen;
  ObstacleWorkspace workspace;
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    const auto shapes = small_shapes(size);
    ToiOptions options;
    options.distance_tolerance = 1e-5 * size;
    for (int k = 0; k < 400; ++k) {
      const RandomScene scene = make_scene(random, shapes, k % 40, size);
      const ObstacleFilter filter = some_groups(random);
      const ObstacleImpact found =
          scene.set.first_impact(*scene.body, *scene.X_WB, kSpan, options, filter, workspace);
      const ToiResult loop = first_of_loop(scene, options, filter);
      ++seen[found.toi.status];
      SCOPED_TRACE(std::to_string(size) + " " + std::to_string(k));
      EXPECT_EQ(found.toi.status, loop.status);
      EXPECT_EQ(found.obstacle.has_value(), found.toi.status != ToiStatus::Separated);
      EXPECT_EQ(found.free_fraction, found.toi.t_safe);
      if (found.toi.status == ToiStatus::Separated) {
        EXPECT_EQ(found.toi.t_safe, kSpan.end);
      }
      if (found.toi.status == ToiStatus::InitiallyWithinTarget) {
        EXPECT_EQ(found.toi.t_safe, 0);
      }
      if (found.toi.status != ToiStatus::Impact) continue;
      // Both stop in the same band of distances; slow bodies take a while to cross it.
      const Obstacle& hit = scene.list.at(*found.obstacle);
      EXPECT_TRUE(is_wanted({*found.obstacle, hit}, filter));
      const Scalar t = found.toi.t_safe;
      const DistanceResult there =
          distance(*scene.body, scene.X_WB->pose(t), *hit.shape, hit.X_WO->pose(t));
      EXPECT_LE(there.lower,
                options.distance_tolerance.value() * 1.0001 + found.toi.rounding_allowance);
      EXPECT_NEAR(t, loop.t_safe, 1e-3);
      for (const auto& entry : scene.list) {
        if (!is_wanted(entry, filter)) continue;
        for (int s = 0; s <= 4; ++s) {
          const Scalar before = t * s / 4;
          const DistanceResult d = distance(*scene.body, scene.X_WB->pose(before),
                                            *entry.second.shape, entry.second.X_WO->pose(before));
          EXPECT_GE(d.upper, options.distance_tolerance.value() / 4 - found.toi.rounding_allowance);
        }
      }
    }
  }
  EXPECT_GT(seen[ToiStatus::Separated], 100);
  EXPECT_GT(seen[ToiStatus::Impact], 100);
  EXPECT_GT(seen[ToiStatus::InitiallyWithinTarget], 50);
}

TEST(ObstacleSet, NearestIsThatOfTheLoop) {
  testing::Random random(37);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    const auto shapes = small_shapes(size);
    for (int k = 0; k < 400; ++k) {
      const RandomScene scene = make_scene(random, shapes, k % 40, size);
      const ObstacleFilter filter = some_groups(random);
      const Scalar t = random.uniform(0, 1);
      const RigidPose X_WB = scene.X_WB->pose(t);
      DistanceOptions options;
      if (k % 3 == 0) options.max_distance = random.uniform(0, 2 * size);
      const NearestObstacle found = scene.set.nearest(*scene.body, X_WB, t, options, filter);
      Scalar lower = kInfinity;
      Scalar upper = kInfinity;
      for (const auto& entry : scene.list) {
        if (!is_wanted(entry, filter)) continue;
        const DistanceResult d =
            distance(*scene.body, X_WB, *entry.second.shape, entry.second.X_WO->pose(t));
        lower = std::min(lower, d.lower);
        upper = std::min(upper, d.upper);
        if (found.obstacle == entry.first) {
          EXPECT_GE(found.distance.upper, d.lower);
        }
      }
      EXPECT_LE(found.distance.lower, upper);
      if (found.distance.status == DistanceStatus::FartherThanMaxDistance) {
        EXPECT_GT(found.distance.lower,
                  options.max_distance < kInfinity ? options.max_distance : 0);
        EXPECT_TRUE(options.max_distance < kInfinity || upper == kInfinity);
        continue;
      }
      ASSERT_TRUE(found.obstacle.has_value());
      EXPECT_GE(found.distance.upper, lower);
      EXPECT_LE(found.distance.upper - found.distance.lower, upper - lower + 1e-9 * size);
      EXPECT_EQ(found.distance.status == DistanceStatus::Separated, lower > 0);
    }
  }
}

TEST(ObstacleSet, LeastDistanceIsThatOfTheLoop) {
  testing::Random random(41);
  const auto shapes = small_shapes(1);
  int apart = 0;
  for (int k = 0; k < 150; ++k) {
    const RandomScene scene = make_scene(random, shapes, k % 12, 1);
    const ObstacleFilter filter = some_groups(random);
    LeastDistanceOptions options;
    if (k % 3 == 0) options.max_distance = random.uniform(0, 1);
    const ObstacleClearance found =
        scene.set.least_distance(*scene.body, *scene.X_WB, kSpan, options, filter);
    Scalar lower = kInfinity;
    Scalar upper = kInfinity;
    for (const auto& entry : scene.list) {
      if (!is_wanted(entry, filter)) continue;
      const LeastDistanceResult d =
          least_distance(*scene.body, *scene.X_WB, *entry.second.shape, *entry.second.X_WO, kSpan);
      lower = std::min(lower, d.lower);
      upper = std::min(upper, d.upper);
    }
    EXPECT_LE(found.distance.lower, upper);
    if (found.distance.status == LeastDistanceStatus::FartherThanMaxDistance) {
      EXPECT_TRUE(found.distance.lower > options.max_distance || !(upper < kInfinity));
      continue;
    }
    EXPECT_EQ(found.distance.status, LeastDistanceStatus::Bounded);
    EXPECT_GE(found.distance.upper, lower);
    EXPECT_LE(found.distance.upper - found.distance.lower,
              0.01 * std::min(found.distance.upper, options.max_distance) + 1e-10);
    if (found.distance.lower > 0) ++apart;
  }
  EXPECT_GT(apart, 20);
}

// A row of balls on the x axis at 3, 4, 5, ..., and the body on its way along it.
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

// Of several at the same time or distance the one with the least id.
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

// The order of additions, and how an obstacle came to where it is, do not matter.
TEST(ObstacleSet, AnswersDoNotDependOnItsHistory) {
  testing::Random random(43);
  const auto shapes = small_shapes(1);
  for (int k = 0; k < 20; ++k) {
    ObstacleSet fresh;
    ObstacleSet moved;
    std::vector<Obstacle> obstacles;
    for (std::size_t i = 0; i < 50; ++i) {
      obstacles.push_back(
          {shapes[i % shapes.size()], testing::rest(random, {4, 4, 3, kSpan}), 1, false});
      fresh.add(obstacles.back());
      moved.add(shapes[i % shapes.size()], RigidPose(random.in_ball(50)));
    }
    const std::vector<ObstacleId> ids = moved.ids();
    for (std::size_t i = ids.size(); i-- > 0;) moved.move(ids[i], obstacles[i].X_WO);
    const Scales scales{5, 5, 3, kSpan};
    const MotionPointer X_WB = testing::hermite(random, scales);
    const Sphere body(0.2);
    const ObstacleImpact x = fresh.first_impact(body, *X_WB, kSpan);
    const ObstacleImpact y = moved.first_impact(body, *X_WB, kSpan);
    EXPECT_EQ(x.toi.status, y.toi.status);
    EXPECT_EQ(x.toi.t_safe, y.toi.t_safe);
    EXPECT_EQ(x.obstacle, y.obstacle);
    const NearestObstacle near_x = fresh.nearest(body, X_WB->pose(0));
    const NearestObstacle near_y = moved.nearest(body, X_WB->pose(0));
    EXPECT_EQ(near_x.distance.lower, near_y.distance.lower);
    EXPECT_EQ(near_x.obstacle, near_y.obstacle);
  }
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
    EXPECT_NE(message.find("the motion of an obstacle is defined on [0, 0.5]"), std::string::npos)
        << message;
  };
  expect_domain(testing::message_of([&] { set.first_impact(*ball, *resting, kSpan); }));
  expect_domain(testing::message_of([&] { set.nearest(*ball, RigidPose(), 0.7); }));
  expect_domain(testing::message_of([&] { set.least_distance(*ball, *resting, kSpan); }));
}

}  // namespace
}  // namespace dyop
