// SPDX-License-Identifier: BSD-3-Clause

// Bodies on a half-space: at rest, sliding, rolling and falling, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;

BodyDefinition ground(std::shared_ptr<const HalfSpace> shape, Scalar friction) {
  BodyDefinition body;
  body.name = "ground";
  body.kind = BodyKind::Static;
  body.shape = std::move(shape);
  body.friction = friction;
  body.restitution = 0;
  return body;
}

// On the plane at its rest gap, its lowest point `depth` below its origin.
BodyDefinition resting(std::shared_ptr<const Shape> shape, const HalfSpace& plane, Scalar depth,
                       const Vector3& beside, Scalar friction) {
  const Scalar gap = rest_gap(shape->bounding_radius());
  const Vector3 p = plane.normal() * (plane.offset() + depth + gap) + beside;
  BodyDefinition body = dynamic_body("body", std::move(shape), p);
  body.initial.X_WB = RigidPose(rotation_between(Vector3::UnitZ(), plane.normal()).normalized(), p);
  body.friction = friction;
  body.restitution = 0;
  return body;
}

WorldOptions with_gravity(const Vector3& gravity_W) {
  WorldOptions options;
  options.gravity_W = gravity_W;
  return options;
}

TEST(HalfSpaceGround, BearsBodiesOfEveryKindAnywhereOnIt) {
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.4, 0.3));
  const auto wheel =
      std::make_shared<TriangleMesh>(gear(9, 0.8, 1, 0.3).vertices, gear(9, 0.8, 1, 0.3).triangles);
  const auto coin = std::make_shared<Cylinder>(0.5, 0.1);
  const Scalar wheel_depth = -wheel->bounding_box().min().z();
  for (const Scalar away : {0.0, 1e4}) {
    const auto plane = std::make_shared<HalfSpace>(Vector3(0, 1, 3), 2);
    World world(with_gravity(-kGravity * plane->normal()));
    world.add_body(ground(plane, 0.8));
    const Vector3 x = Vector3::UnitX();
    std::vector<BodyId> ids{
        world.add_body(resting(box, *plane, 0.3, away * x, 0.8)),
        world.add_body(resting(wheel, *plane, wheel_depth, (away + 4) * x, 0.8)),
        world.add_body(resting(coin, *plane, 0.1, (away - 4) * x, 0.8)),
    };
    std::vector<RigidPose> starts;
    for (const BodyId id : ids) starts.push_back(world.state(id).X_WB);
    run_for(world, 2);
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const RigidPose end = world.state(ids[k]).X_WB;
      EXPECT_TRUE(world.is_asleep(ids[k])) << k;
      EXPECT_LT((end.translation() - starts[k].translation()).norm(), 1e-5) << k;
      EXPECT_LT((end.rotation() - starts[k].rotation()).norm(), 1e-5) << k;
    }
  }
}

// A block slides down a slope with g (sin - mu cos); one with more friction stays.
TEST(HalfSpaceGround, ABlockSlidesAsCoulombSays) {
  const Scalar angle = 0.4;
  const auto plane = std::make_shared<HalfSpace>(Vector3(std::sin(angle), 0, std::cos(angle)));
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.4, 0.1));
  for (const Scalar friction : {0.0, 0.2, 0.8}) {
    World world(with_gravity(Vector3(0, 0, -kGravity)));
    world.add_body(ground(plane, friction));
    const BodyId id = world.add_body(resting(box, *plane, 0.1, Vector3::Zero(), friction));
    const Vector3 start = world.state(id).X_WB.translation();
    run_for(world, 1);
    const Scalar pull = std::max(0.0, std::sin(angle) - friction * std::cos(angle));
    const Scalar way = (world.state(id).X_WB.translation() - start).norm();
    EXPECT_NEAR(way, kGravity * pull / 2, 0.02 * kGravity * pull + 1e-5);
    EXPECT_GT(plane->height(world.state(id).X_WB.translation()), 0.1);
  }
}

TEST(HalfSpaceGround, NothingFallsThrough) {
  World world(with_gravity(Vector3(0, 0, -kGravity)));
  world.add_body(ground(std::make_shared<HalfSpace>(), 0.5));
  const auto wheel =
      std::make_shared<TriangleMesh>(gear(9, 0.8, 1, 0.3).vertices, gear(9, 0.8, 1, 0.3).triangles);
  BodyDefinition falling = dynamic_body("wheel", wheel, {0, 0, 5}, {3, 0, -200}, {5, 7, 1});
  const BodyId id = world.add_body(falling);
  const BodyId ball = world.add_body(
      dynamic_body("ball", std::make_shared<Capsule>(0.3, 0.4), {4, 0, 3}, {0, 0, -900}));
  for (int k = 0; k < 100; ++k) {
    ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
    const RigidPose X_WB = world.state(id).X_WB;
    for (const Vector3& v : wheel->vertices()) ASSERT_GT((X_WB * v).z(), 0);
    const RigidPose X_WC = world.state(ball).X_WB;
    ASSERT_GT(X_WC.translation().z() - 0.4 * std::abs(X_WC.rotation()(2, 2)) - 0.3, 0);
  }
}

// An elevator floor carries what stands on it.
TEST(HalfSpaceGround, MayMoveByItself) {
  World world(with_gravity(Vector3(0, 0, -kGravity)));
  const auto plane = std::make_shared<HalfSpace>();
  BodyDefinition floor = ground(plane, 0.5);
  floor.kind = BodyKind::Kinematic;
  floor.motion =
      std::make_shared<ConstantTwistMotion>(RigidPose(), Twist{{0, 0, 0.5}, Vector3::Zero()});
  world.add_body(floor);
  BodyDefinition box =
      resting(std::make_shared<Box>(Vector3(0.3, 0.3, 0.3)), *plane, 0.3, Vector3::Zero(), 0.5);
  box.initial.twist.v_WB = Vector3(0, 0, 0.5);
  const BodyId id = world.add_body(box);
  run_for(world, 1);
  const Scalar height = world.state(id).X_WB.translation().z();
  EXPECT_GT(height, 0.8);
  EXPECT_NEAR(height, 0.8, 1e-3);
}

TEST(HalfSpaceGround, CannotBeDynamic) {
  World world(WorldOptions{});
  BodyDefinition body = ground(std::make_shared<HalfSpace>(), 0.5);
  body.kind = BodyKind::Dynamic;
  body.mass_properties = Sphere(1).compute_mass_properties(1);
  try {
    world.add_body(body);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(),
                 "body 'ground': a half-space must be static or kinematic, not dynamic");
  }
}

// Rays, casts and overlaps of a World see it as any other body.
TEST(HalfSpaceGround, AnswersQueriesOfAWorld) {
  World world(WorldOptions{});
  const BodyId id = world.add_body(ground(std::make_shared<HalfSpace>(Vector3::UnitZ(), 1), 0.5));
  world.add_body(dynamic_body("ball", std::make_shared<Sphere>(0.5), {9, 0, 5}));
  const BodyRayHit hit = world.cast_ray(Vector3(100, 200, 4), Vector3(0, 0, -1), 50);
  ASSERT_EQ(hit.status, ToiStatus::Impact);
  EXPECT_NEAR(hit.distance, 3, 1e-6);
  EXPECT_LE(hit.distance, 3);
  EXPECT_EQ(hit.body, id);
  const NearestBody nearest = world.nearest(Sphere(1), RigidPose(Vector3(500, 0, 3)));
  EXPECT_EQ(nearest.body, id);
  EXPECT_NEAR(nearest.distance.upper, 1, 1e-9);
  const BodyOverlaps overlaps = world.overlaps(Sphere(1), RigidPose(Vector3(500, 0, -30)), 0);
  ASSERT_EQ(overlaps.bodies.size(), 1U);
  EXPECT_EQ(overlaps.bodies[0], id);
}

}  // namespace
}  // namespace dyop
