// SPDX-License-Identifier: BSD-3-Clause

// Queries of the bodies of a World, against one query for each body.
#include "dyop/dynamics/world_query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

// Many small bodies of several shapes in a cube of this size about a place.
struct Crowd {
  Crowd(Scalar size, const Vector3& place, int count, unsigned seed) : random(seed), scale(size) {
    for (int k = 0; k < count; ++k) {
      std::shared_ptr<const Shape> shape;
      const Scalar r = 0.05 * size;
      if (k % 3 == 0) shape = std::make_shared<Sphere>(r);
      if (k % 3 == 1) shape = std::make_shared<Box>(Vector3(r, 1.5 * r, 0.5 * r));
      if (k % 3 == 2) shape = std::make_shared<Capsule>(r, 2 * r);
      BodyDefinition body = dynamic_body("body", shape, place + size * some());
      body.initial.X_WB = RigidPose(rotation_from_vector(3 * some()), place + size * some());
      body.initial.twist.v_WB = 0.1 * size * some();
      body.filter.category = k % 2 == 0 ? 1 : 2;
      ids.push_back(world.add_body(body));
    }
  }
  Vector3 some() {
    std::uniform_real_distribution<Scalar> in(-1, 1);
    return {in(random), in(random), in(random)};
  }
  const Shape& shape(BodyId id) const { return *world.body(id).shape; }
  RigidPose pose(BodyId id) const { return world.state(id).X_WB; }

  std::mt19937 random;
  Scalar scale;
  World world;
  std::vector<BodyId> ids;
};

// The first body along a ray, by one time of impact for each.
std::optional<std::pair<Scalar, BodyId>> first_by_loop(const Crowd& crowd, const Vector3& origin_W,
                                                       const Vector3& along, Scalar length) {
  const ConvexHull point({Vector3::Zero()});
  std::optional<std::pair<Scalar, BodyId>> first;
  for (const BodyId id : crowd.ids) {
    const ToiResult met =
        time_of_impact(point, ConstantTwistMotion(RigidPose(origin_W), {along, {}}),
                       crowd.shape(id), RestMotion(crowd.pose(id)), {0, length});
    if (met.status == ToiStatus::Separated) continue;
    if (!first || met.t_safe < first->first) first = std::pair(met.t_safe, id);
  }
  return first;
}

TEST(WorldQuery, ARayMeetsWhatALoopMeets) {
  for (const Scalar size : {1e-3, 1.0, 1e3}) {
    Crowd crowd(size, Vector3(5, -3, 2) * size, 60, 7);
    int hits = 0;
    for (int k = 0; k < 60; ++k) {
      if (k == 30) crowd.world.advance(0.1);  // and again where they are then
      const Vector3 origin = Vector3(5, -3, 2) * size + 2 * size * crowd.some();
      const Vector3 goal = Vector3(5, -3, 2) * size + 0.7 * size * crowd.some();
      const Vector3 along = (goal - origin).normalized();
      const BodyRayHit hit = crowd.world.cast_ray(origin, 7 * along, 4 * size);
      const auto expected = first_by_loop(crowd, origin, along, 4 * size);
      ASSERT_EQ(hit.body.has_value(), expected.has_value());
      if (!expected) {
        EXPECT_EQ(hit.status, ToiStatus::Separated);
        EXPECT_EQ(hit.distance, 4 * size);
        continue;
      }
      ++hits;
      EXPECT_EQ(*hit.body, expected->second);
      EXPECT_NEAR(hit.distance, expected->first, 1e-6 * size);
      if (hit.status != ToiStatus::Impact) continue;
      EXPECT_LT((hit.p_W - (origin + hit.distance * along)).norm(), 1e-5 * size);
      EXPECT_LT(hit.nhat_W.dot(along), 0);
    }
    EXPECT_GT(hits, 5);
    EXPECT_LT(hits, 55);
  }
}

TEST(WorldQuery, ARayFindsPlaceAndNormalOfABox) {
  World world;
  const auto box = std::make_shared<Box>(Vector3(1, 2, 3));
  const BodyId id = world.add_body(dynamic_body("box", box, {10, 0, 0}));
  const BodyRayHit hit = world.cast_ray({0, 0.5, 0.25}, {2, 0, 0}, 20);
  EXPECT_EQ(hit.status, ToiStatus::Impact);
  EXPECT_EQ(hit.body, id);
  EXPECT_NEAR(hit.distance, 9, 1e-5);
  EXPECT_LT((hit.p_W - Vector3(9, 0.5, 0.25)).norm(), 1e-5);
  EXPECT_LT((hit.nhat_W - Vector3(-1, 0, 0)).norm(), 1e-9);
  EXPECT_EQ(world.cast_ray({0, 0.5, 0.25}, {2, 0, 0}, 8.9).status, ToiStatus::Separated);
  EXPECT_EQ(world.cast_ray({10, 0.5, 0.25}, {2, 0, 0}, 1).status, ToiStatus::InitiallyWithinTarget);
}

TEST(WorldQuery, FollowsEveryChange) {
  World world;
  const auto box = std::make_shared<Box>(Vector3(1, 1, 1));
  const auto distance_along_x = [&] { return world.cast_ray({0, 0, 0}, {1, 0, 0}, 100).distance; };
  EXPECT_EQ(distance_along_x(), 100);
  const BodyId id = world.add_body(dynamic_body("box", box, {10, 0, 0}, {1, 0, 0}));
  EXPECT_NEAR(distance_along_x(), 9, 1e-5);
  world.advance(1);
  EXPECT_NEAR(distance_along_x(), 10, 1e-5);
  const WorldSnapshot snapshot = world.snapshot();
  world.set_state(id, {RigidPose(Vector3(5, 0, 0)), {}});
  EXPECT_NEAR(distance_along_x(), 4, 1e-5);
  world.set_shape(id, std::make_shared<Sphere>(2));
  EXPECT_NEAR(distance_along_x(), 3, 1e-5);
  world.set_enabled(id, false);
  EXPECT_EQ(distance_along_x(), 100);
  world.set_enabled(id, true);
  EXPECT_NEAR(distance_along_x(), 3, 1e-5);
  world.restore(snapshot);
  EXPECT_NEAR(distance_along_x(), 10, 1e-5);
  world.remove_body(id);
  EXPECT_EQ(distance_along_x(), 100);
  BodyDefinition carried;
  carried.kind = BodyKind::Kinematic;
  carried.shape = box;
  carried.motion = std::make_shared<ConstantTwistMotion>(RigidPose(Vector3(20, 0, 0)),
                                                         Twist{{-1, 0, 0}, Vector3::Zero()});
  world.add_body(carried);
  EXPECT_NEAR(distance_along_x(), 19 - world.time(), 1e-5);
  world.advance(2);
  EXPECT_NEAR(distance_along_x(), 19 - world.time(), 1e-5);
  World moved = std::move(world);
  EXPECT_NEAR(moved.cast_ray({0, 0, 0}, {1, 0, 0}, 100).distance, 19 - moved.time(), 1e-5);
}

TEST(WorldQuery, NearestAndOverlapsAreThoseOfALoop) {
  for (const Scalar size : {1e-3, 1.0, 1e3}) {
    Crowd crowd(size, Vector3(-4, 8, 1) * size, 60, 11);
    std::size_t found = 0;
    for (int k = 0; k < 40; ++k) {
      const Box probe(Vector3(0.1, 0.2, 0.1) * size);
      const RigidPose X_WP(rotation_from_vector(crowd.some()),
                           Vector3(-4, 8, 1) * size + size * crowd.some());
      const Scalar reach = k % 2 == 0 ? 0 : 0.1 * size;
      const NearestBody nearest = crowd.world.nearest(probe, X_WP);
      const BodyOverlaps overlaps = crowd.world.overlaps(probe, X_WP, reach);
      Scalar least = kInfinity;
      std::vector<BodyId> expected;
      for (const BodyId id : crowd.ids) {
        const DistanceResult d = distance(probe, X_WP, crowd.shape(id), crowd.pose(id));
        least = std::min(least, d.upper);
        const bool touches = d.status == DistanceStatus::Overlapping;
        if (touches || d.upper <= reach) expected.push_back(id);
      }
      EXPECT_NEAR(nearest.distance.upper, least, 1e-9 * size);
      EXPECT_EQ(overlaps.bodies, expected);
      EXPECT_TRUE(overlaps.undecided.empty());
      found += expected.size();
    }
    EXPECT_GT(found, 20U);
  }
}

TEST(WorldQuery, ConsidersWhatTheFilterAccepts) {
  World world;
  const auto add = [&](Scalar x, std::uint64_t category, bool is_sensor = false) {
    BodyDefinition body = dynamic_body("ball", std::make_shared<Sphere>(0.5), {x, 0, 0});
    body.filter.category = category;
    body.filter.mask = category == 4 ? 8 : ~std::uint64_t{0};
    body.is_sensor = is_sensor;
    return world.add_body(body);
  };
  const BodyId one = add(2, 1);
  const BodyId two = add(4, 2);
  const BodyId four = add(6, 4);
  const BodyId sensor = add(1, 1, true);
  const auto first = [&](const BodyFilter& filter) {
    return world.cast_ray({0, 0, 0}, {1, 0, 0}, 10, filter).body;
  };
  EXPECT_EQ(first({}), one);
  BodyFilter filter;
  filter.includes_sensors = true;
  EXPECT_EQ(first(filter), sensor);
  filter = {};
  filter.mask = 2 | 4;
  EXPECT_EQ(first(filter), two);
  filter.mask = 4;
  EXPECT_EQ(first(filter), four);
  filter.category = 1;  // which body four does not see
  EXPECT_EQ(first(filter), std::nullopt);
  filter = {};
  filter.accepts = [&](BodyId id) { return id != one; };
  EXPECT_EQ(first(filter), two);
  const Sphere all(20);
  EXPECT_EQ(world.overlaps(all, RigidPose()).bodies, (std::vector<BodyId>{one, two, four}));
  EXPECT_EQ(world.nearest(Sphere(0.1), RigidPose(), {}, filter).body, two);
}

TEST(WorldQuery, ClosedMeshesAreSolid) {
  World world;
  const Box box(Vector3(1, 1, 1));
  BodyDefinition body = dynamic_body("mesh", std::make_shared<Box>(Vector3(1, 1, 1)), {0, 0, 0});
  const std::vector<Vector3> corners{{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const std::vector<std::array<std::int32_t, 3>> faces{{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7},
                                                       {0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5},
                                                       {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  body.shape = std::make_shared<TriangleMesh>(corners, faces);
  const BodyId id = world.add_body(body);
  const Sphere small(0.1);
  EXPECT_EQ(world.overlaps(small, RigidPose()).bodies, std::vector<BodyId>{id});
  EXPECT_EQ(world.cast_ray({0, 0, 0}, {0, 0, 1}, 5).status, ToiStatus::InitiallyWithinTarget);
  EXPECT_TRUE(world.overlaps(small, RigidPose(Vector3(3, 0, 0))).bodies.empty());
  const BodyRayHit hit = world.cast_ray({0.3, 0.2, 5}, {0, 0, -1}, 10);
  EXPECT_EQ(hit.status, ToiStatus::Impact);
  EXPECT_TRUE(hit.triangle.has_value());
}

TEST(WorldQuery, RefusesWhatCannotBe) {
  const World world;
  const auto refuses = [](const auto& call, const char* what) {
    EXPECT_NE(message_of(call).find(what), std::string::npos) << message_of(call);
  };
  refuses(
      [&] {
        world.cast_ray({0, 0, 0}, {0, 0, 0}, 1);
      },
      "direction must be finite and not zero");
  refuses(
      [&] {
        world.cast_ray({0, 0, 0}, {1, 0, 0}, -1);
      },
      "length must be finite and > 0, not -1");
  refuses([&] { world.cast_ray({kInfinity, 0, 0}, {1, 0, 0}, 1); }, "origin must be finite");
  refuses([&] { world.overlaps(Sphere(1), RigidPose(), -2); }, "distance must be finite and >= 0");
}

}  // namespace
}  // namespace dyop
