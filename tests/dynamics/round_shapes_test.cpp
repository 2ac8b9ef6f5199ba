// SPDX-License-Identifier: BSD-3-Clause

// Cylinders and cones that stand, lie, lean, slide and roll, against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr std::array<Scalar, 3> kScales{1e-4, 1, 1e4};
const Matrix3 kUpright = Matrix3::Identity();
// The axis along y.
const Matrix3 kLying = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));

// Lengths and gravity in units of `size`, so that times are the same; the ground leans by an angle
// about y.
WorldOptions leaning(Scalar angle, Scalar size = 1) {
  WorldOptions options;
  options.gravity_W = size * kGravity * Vector3(std::sin(angle), 0, -std::cos(angle));
  return options;
}

BodyDefinition ground(std::shared_ptr<const Shape> shape, const Vector3& p, Scalar friction) {
  BodyDefinition body;
  body.name = "ground";
  body.kind = BodyKind::Static;
  body.shape = std::move(shape);
  body.initial.X_WB = RigidPose(p);
  body.friction = friction;
  body.restitution = 0;
  return body;
}

BodyDefinition box_ground(Scalar friction, Scalar size = 1) {
  return ground(std::make_shared<Box>(size * Vector3(20, 20, 1)), size * Vector3(0, 0, -1),
                friction);
}

// A grid of triangles at z = 0.
BodyDefinition mesh_ground(Scalar friction, int parts, Scalar size = 1) {
  const MeshArrays plate = plate_grid(4 * size, 4 * size, parts, parts);
  return ground(std::make_shared<TriangleMesh>(plate.vertices, plate.triangles), Vector3::Zero(),
                friction);
}

BodyDefinition body_at(std::shared_ptr<const Shape> shape, const Matrix3& R, const Vector3& p,
                       Scalar friction) {
  BodyDefinition body = dynamic_body("body", std::move(shape), p);
  body.initial.X_WB = RigidPose(R, p);
  body.friction = friction;
  body.restitution = 0;
  return body;
}

// At its rest gap above z = 0, with its lowest point `depth` below the origin.
BodyDefinition resting(std::shared_ptr<const Shape> shape, const Matrix3& R, Scalar depth,
                       Scalar friction = 0.8) {
  const Scalar gap = rest_gap(shape->bounding_radius());
  return body_at(std::move(shape), R, Vector3(0, 0, depth + gap), friction);
}

void advance_for(World& world, Scalar time) {
  for (int k = 0; k < static_cast<int>(std::lround(time / 0.01)); ++k) {
    const AdvanceReport report = world.advance(0.01);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(report.work.stalls, 0);
  }
}

// A body that is where it belongs stays there, and sleeps.
void expect_rest(const WorldOptions& options, const std::vector<BodyDefinition>& bodies,
                 Scalar size = 1) {
  World world(options);
  std::vector<BodyId> ids;
  for (const BodyDefinition& body : bodies) ids.push_back(world.add_body(body));
  advance_for(world, 2);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    if (bodies[k].kind != BodyKind::Dynamic) continue;
    const RigidPose& start = bodies[k].initial.X_WB;
    const RigidPose end = world.state(ids[k]).X_WB;
    EXPECT_TRUE(world.is_asleep(ids[k])) << k;
    EXPECT_LT((end.translation() - start.translation()).norm(), 1e-5 * size) << k;
    EXPECT_LT((end.rotation() - start.rotation()).norm(), 1e-5) << k;
  }
}

TEST(RoundShapes, CylinderStandsAndSleeps) {
  for (const Scalar size : kScales) {
    SCOPED_TRACE(size);
    const auto shape = std::make_shared<Cylinder>(0.3 * size, 0.5 * size);
    const BodyDefinition body = resting(shape, kUpright, 0.5 * size);
    expect_rest(leaning(0, size), {box_ground(0.8, size), body}, size);
    expect_rest(leaning(0, size), {mesh_ground(0.8, 1, size), body}, size);
    expect_rest(leaning(0, size), {mesh_ground(0.8, 40, size), body}, size);
  }
}

TEST(RoundShapes, CoinLiesAndSleeps) {
  const auto shape = std::make_shared<Cylinder>(0.5, 0.02);
  expect_rest(leaning(0), {box_ground(0.5), resting(shape, kUpright, 0.02)});
}

TEST(RoundShapes, CylinderLiesAndSleeps) {
  for (const Scalar size : kScales) {
    SCOPED_TRACE(size);
    const auto shape = std::make_shared<Cylinder>(0.3 * size, 0.5 * size);
    const BodyDefinition body = resting(shape, kLying, 0.3 * size);
    expect_rest(leaning(0, size), {box_ground(0.8, size), body}, size);
    expect_rest(leaning(0, size), {mesh_ground(0.8, 7, size), body}, size);
  }
}

TEST(RoundShapes, ConeStandsAndSleeps) {
  for (const Scalar size : kScales) {
    SCOPED_TRACE(size);
    const auto shape = std::make_shared<Cone>(0.4 * size, 0.5 * size);
    expect_rest(leaning(0, size), {box_ground(0.8, size), resting(shape, kUpright, 0.5 * size)},
                size);
  }
}

// On its side the axis leans by the angle of the side.
TEST(RoundShapes, ConeLiesAndSleeps) {
  const Scalar r = 0.4;
  const Scalar h = 0.5;
  const Scalar side = std::atan2(r, 2 * h);
  const Matrix3 R = rotation_from_vector(Vector3(0, std::numbers::pi / 2 + side, 0));
  const auto shape = std::make_shared<Cone>(r, h);
  // The origin is half way up the axis, h from the tip.
  expect_rest(leaning(0), {box_ground(0.8), resting(shape, R, h * std::sin(side))});
}

TEST(RoundShapes, RoundedCylinderStandsLiesAndSleeps) {
  const auto shape = std::make_shared<RoundedCylinder>(0.25, 0.4, 0.1);
  for (const BodyDefinition& ground : {box_ground(0.8), mesh_ground(0.8, 7)}) {
    expect_rest(leaning(0), {ground, resting(shape, kUpright, 0.5)});
    expect_rest(leaning(0), {ground, resting(shape, kLying, 0.35)});
  }
}

// The side leans, so that both balls reach down equally far.
TEST(RoundShapes, TaperedCapsuleLiesAndSleeps) {
  const auto shape = std::make_shared<TaperedCapsule>(0.4, 0.2, 0.5);
  const Scalar lean = std::asin(0.2);
  const Matrix3 R = rotation_from_vector(Vector3(0, std::numbers::pi / 2 + lean, 0));
  expect_rest(leaning(0), {box_ground(0.8), resting(shape, R, 0.3)});
}

TEST(RoundShapes, CylindersStandOnCylinders) {
  const auto wide = std::make_shared<Cylinder>(0.5, 0.2);
  const auto narrow = std::make_shared<Cylinder>(0.3, 0.4);
  const BodyDefinition lower = resting(wide, kUpright, 0.2);
  const Scalar top = lower.initial.X_WB.translation().z() + 0.2;
  const Scalar z = top + 0.4 + rest_gap(narrow->bounding_radius());
  expect_rest(leaning(0), {box_ground(0.8), lower, body_at(narrow, kUpright, {0, 0, z}, 0.8)});
  // Over the rim, but with the centre above it.
  expect_rest(leaning(0), {box_ground(0.8), lower, body_at(narrow, kUpright, {0.3, -0.2, z}, 0.8)});
}

TEST(RoundShapes, CylinderOnItsSideRestsBetweenTwo) {
  World world(leaning(0));
  world.add_body(box_ground(0.8));
  const auto shape = std::make_shared<Cylinder>(0.3, 0.5);
  const auto beam = std::make_shared<Box>(Vector3(0.1, 2, 0.1));
  world.add_body(ground(beam, {-0.3, 0, 0.1}, 0.8));
  world.add_body(ground(beam, {0.3, 0, 0.1}, 0.8));
  // On the two inner edges, 0.2 from the middle at a height of 0.2.
  const Scalar height = 0.2 + std::sqrt(0.09 - 0.04);
  const BodyId id = world.add_body(body_at(shape, kLying, {0, 0, height + 0.01}, 0.8));
  advance_for(world, 2);
  EXPECT_TRUE(world.is_asleep(id));
  const Vector3 p = world.state(id).X_WB.translation();
  EXPECT_NEAR(p.x(), 0, 1e-3);
  EXPECT_NEAR(p.z(), height, 1e-3);
}

// A cylinder and its like roll with g sin / (1 + I / (m r^2)).
void expect_rolling(const BodyDefinition& floor, Scalar size) {
  constexpr Scalar kAngle = 0.3;
  World world(leaning(kAngle, size));
  world.add_body(floor);
  const Scalar r = 0.3 * size;
  const BodyId id = world.add_body(resting(std::make_shared<Cylinder>(r, 0.5 * size), kLying, r));
  advance_for(world, 0.8);
  const Scalar acceleration = size * kGravity * std::sin(kAngle) * 2 / 3;
  const MotionState state = world.state(id);
  EXPECT_NEAR(state.twist.v_WB.x(), 0.8 * acceleration, 5e-3 * acceleration);
  EXPECT_NEAR(state.X_WB.translation().x(), 0.32 * acceleration, 5e-3 * acceleration);
  EXPECT_NEAR(state.twist.w_WB.y(), 0.8 * acceleration / r, 5e-3 * acceleration / r);
  EXPECT_NEAR(state.X_WB.translation().y(), 0, 1e-3 * size);
}

TEST(RoundShapes, CylinderRollsDownASlope) {
  for (const Scalar size : kScales) {
    SCOPED_TRACE(size);
    expect_rolling(box_ground(0.8, size), size);
  }
}

TEST(RoundShapes, CylinderRollsOverTrianglesOfAPlane) {
  expect_rolling(mesh_ground(0.8, 9), 1);
}

TEST(RoundShapes, CylinderOnItsCapStaysWithinTheConeOfFriction) {
  const Scalar friction = 0.4;
  const auto shape = std::make_shared<Cylinder>(0.5, 0.3);
  expect_rest(leaning(std::atan(friction) * 0.98),
              {box_ground(friction), resting(shape, kUpright, 0.3, friction)});
}

TEST(RoundShapes, CylinderOnItsCapSlidesOutsideTheConeOfFriction) {
  const Scalar friction = 0.4;
  const Scalar angle = std::atan(friction) * 1.2;
  World world(leaning(angle));
  world.add_body(box_ground(friction));
  const auto shape = std::make_shared<Cylinder>(0.5, 0.3);
  const BodyId id = world.add_body(resting(shape, kUpright, 0.3, friction));
  advance_for(world, 1);
  const Scalar acceleration = kGravity * (std::sin(angle) - friction * std::cos(angle));
  EXPECT_NEAR(world.state(id).twist.v_WB.x(), acceleration, 5e-3 * acceleration);
  EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-3);
}

// Whether a body stays upright for two seconds.
bool stands(const WorldOptions& options, const std::vector<BodyDefinition>& bodies) {
  World world(options);
  BodyId last;
  for (const BodyDefinition& body : bodies) last = world.add_body(body);
  const Matrix3 start = world.state(last).X_WB.rotation();
  advance_for(world, 2);
  return (world.state(last).X_WB.rotation() - start).norm() < 0.01;
}

// The weight passes the rim where tan a = r / h.
TEST(RoundShapes, CylinderTipsOverItsRim) {
  const auto shape = std::make_shared<Cylinder>(0.2, 0.5);
  for (const Scalar turn : {0.0, 0.1, 0.5}) {
    const Matrix3 R = rotation_from_vector(Vector3(0, 0, turn));
    for (const Scalar part : {0.97, 1.03}) {
      SCOPED_TRACE(part);
      const std::vector<BodyDefinition> bodies{box_ground(2), resting(shape, R, 0.5, 2)};
      EXPECT_EQ(stands(leaning(std::atan(part * 0.4)), bodies), part < 1);
    }
  }
}

// The centre of mass of a cone is a quarter of its height above the base.
TEST(RoundShapes, ConeTipsOverItsRim) {
  const auto shape = std::make_shared<Cone>(0.2, 0.5);
  for (const Scalar part : {0.97, 1.03}) {
    SCOPED_TRACE(part);
    const std::vector<BodyDefinition> bodies{box_ground(2), resting(shape, kUpright, 0.5, 2)};
    EXPECT_EQ(stands(leaning(std::atan(part * 0.8)), bodies), part < 1);
  }
}

// A plate over the rim of a column, towards a corner of the contacts' hexagon and between two.
TEST(RoundShapes, PlateTipsOverTheRimOfAColumn) {
  const auto column = std::make_shared<Cylinder>(0.5, 0.5);
  const auto plate = std::make_shared<Box>(Vector3(0.8, 0.8, 0.1));
  const BodyDefinition lower = ground(column, {0, 0, 0.5}, 0.8);
  for (const Scalar angle : {0.0, 0.3, std::numbers::pi / 6, std::numbers::pi / 2}) {
    for (const Scalar part : {0.97, 1.03}) {
      SCOPED_TRACE(part);
      const Vector3 out(std::cos(angle), std::sin(angle), 0);
      const Vector3 p = 0.5 * part * out + Vector3(0, 0, 1.1 + rest_gap(column->bounding_radius()));
      EXPECT_EQ(stands(leaning(0), {lower, body_at(plate, kUpright, p, 0.8)}), part < 1) << angle;
    }
  }
}

// Over a corner of a table, with the centre inside or outside.
TEST(RoundShapes, CylinderTipsOverTheCornerOfABox) {
  const auto shape = std::make_shared<Cylinder>(0.4, 0.3);
  const BodyDefinition table = ground(std::make_shared<Box>(Vector3(1, 1, 1)), {-1, -1, -1}, 0.8);
  for (const Scalar x : {-0.02, 0.02}) {
    SCOPED_TRACE(x);
    const Vector3 p(x, -0.05, 0.3 + rest_gap(shape->bounding_radius()));
    EXPECT_EQ(stands(leaning(0), {table, body_at(shape, kUpright, p, 0.8)}), x < 0);
  }
}

TEST(RoundShapes, CapsuleLiesOnAColumn) {
  const auto column = std::make_shared<Cylinder>(0.5, 0.5);
  const auto capsule = std::make_shared<Capsule>(0.1, 0.4);
  const Scalar z = 1.1 + rest_gap(capsule->bounding_radius());
  expect_rest(leaning(0),
              {ground(column, {0, 0, 0.5}, 0.8), body_at(capsule, kLying, {0, 0, z}, 0.8)});
}

// A ball that spins on its point, which friction of points does not stop, among others that lie: its
// speed must not cost the others their exactness.
TEST(RoundShapes, BallsLieStillBesideOneThatSpins) {
  constexpr int kSide = 5;
  constexpr Scalar kRadius = 0.5;
  constexpr Scalar kStep = 0.01;
  const Scalar gap = rest_gap(kRadius);
  const Scalar spin = 40 * gap / (kRadius * kStep);
  World world(leaning(0));
  world.add_body(box_ground(0.5));
  std::vector<std::pair<BodyId, Vector3>> balls;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vector3 p((2 * kRadius + gap) * (i % kSide), (2 * kRadius + gap) * (i / kSide),
                    kRadius + gap);
    const bool spins = i == kSide * kSide / 2;
    BodyDefinition ball = dynamic_body("ball", std::make_shared<Sphere>(kRadius), p,
                                       Vector3::Zero(), Vector3(0, 0, spins ? spin : 0));
    ball.friction = 0.5;
    ball.restitution = 0;
    balls.emplace_back(world.add_body(ball), p);
  }
  constexpr int kSteps = 50;
  for (int k = 0; k < kSteps; ++k) {
    const AdvanceReport report = world.advance(kStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_EQ(report.work.unconverged, 0);
    EXPECT_EQ(report.work.islands, 1);
  }
  for (const auto& [id, p] : balls) {
    EXPECT_LE((world.state(id).X_WB.translation() - p).norm(), 0.01 * kSteps * gap);
  }
  EXPECT_NEAR(world.state(balls[kSide * kSide / 2].first).twist.w_WB.z(), spin, 1e-3 * spin);
}

TEST(RoundShapes, AreTheSameForAnyNumberOfThreads) {
  const auto end = [](int threads) {
    WorldOptions options = leaning(0.1);
    options.thread_count = threads;
    World world(options);
    world.add_body(box_ground(0.3));
    const auto shape = std::make_shared<Cylinder>(0.3, 0.4);
    BodyId last;
    for (int k = 0; k < 6; ++k) {
      const Matrix3 R = rotation_from_vector(Vector3(0.4 * k, 0.3, 0.1 * k));
      last = world.add_body(body_at(shape, R, {0.2 * k, 0.1 * k, 1 + 1.1 * k}, 0.3));
    }
    for (int k = 0; k < 150; ++k) world.advance(0.01);
    return world.state(last).X_WB.translation();
  };
  const Vector3 one = end(1);
  EXPECT_EQ(one, end(2));
  EXPECT_EQ(one, end(4));
}

}  // namespace
}  // namespace dyop
