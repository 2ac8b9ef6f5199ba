// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/tolerance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/toi/obstacle_set.h"
#include "geometry/all_compounds.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"

namespace dyop {
namespace {

using namespace testing;  // NOLINT: makers
using testing::at;
using testing::kAllMotions;
using testing::MotionPointer;
using testing::Scales;

constexpr TimeInterval kUnitSpan{0, 1};

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
  const Scales scales{4 * size, 4 * size, 3, kUnitSpan};
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
  first.t_safe = kUnitSpan.end;
  for (const auto& entry : scene.list) {
    if (!is_wanted(entry, filter)) continue;
    const ToiResult found = time_of_impact(*scene.body, *scene.X_WB, *entry.second.shape,
                                           *entry.second.X_WO, kUnitSpan, options);
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
          scene.set.first_impact(*scene.body, *scene.X_WB, kUnitSpan, options, filter, workspace);
      const ToiResult loop = first_of_loop(scene, options, filter);
      ++seen[found.toi.status];
      SCOPED_TRACE(std::to_string(size) + " " + std::to_string(k));
      EXPECT_EQ(found.toi.status, loop.status);
      EXPECT_EQ(found.obstacle.has_value(), found.toi.status != ToiStatus::Separated);
      EXPECT_EQ(found.free_fraction, found.toi.t_safe);
      if (found.toi.status == ToiStatus::Separated) {
        EXPECT_EQ(found.toi.t_safe, kUnitSpan.end);
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
        scene.set.least_distance(*scene.body, *scene.X_WB, kUnitSpan, options, filter);
    Scalar lower = kInfinity;
    Scalar upper = kInfinity;
    for (const auto& entry : scene.list) {
      if (!is_wanted(entry, filter)) continue;
      const LeastDistanceResult d = least_distance(*scene.body, *scene.X_WB, *entry.second.shape,
                                                   *entry.second.X_WO, kUnitSpan);
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
          {shapes[i % shapes.size()], testing::rest(random, {4, 4, 3, kUnitSpan}), 1, false});
      fresh.add(obstacles.back());
      moved.add(shapes[i % shapes.size()], RigidPose(random.in_ball(50)));
    }
    const std::vector<ObstacleId> ids = moved.ids();
    for (std::size_t i = ids.size(); i-- > 0;) moved.move(ids[i], obstacles[i].X_WO);
    const Scales scales{5, 5, 3, kUnitSpan};
    const MotionPointer X_WB = testing::hermite(random, scales);
    const Sphere body(0.2);
    const ObstacleImpact x = fresh.first_impact(body, *X_WB, kUnitSpan);
    const ObstacleImpact y = moved.first_impact(body, *X_WB, kUnitSpan);
    EXPECT_EQ(x.toi.status, y.toi.status);
    EXPECT_EQ(x.toi.t_safe, y.toi.t_safe);
    EXPECT_EQ(x.obstacle, y.obstacle);
    const NearestObstacle near_x = fresh.nearest(body, X_WB->pose(0));
    const NearestObstacle near_y = moved.nearest(body, X_WB->pose(0));
    EXPECT_EQ(near_x.distance.lower, near_y.distance.lower);
    EXPECT_EQ(near_x.obstacle, near_y.obstacle);
  }
}

}  // namespace
}  // namespace dyop
