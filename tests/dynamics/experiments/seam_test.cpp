// SPDX-License-Identifier: BSD-3-Clause

// What slides, rolls or glides over the seams of a floor of tiles, or past an edge, keeps its speed:
// nothing there stands in its way.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kSpeed = 3;
constexpr Scalar kTile = 0.5;
constexpr Scalar kTileHeight = 0.2;

std::shared_ptr<const Shape> tile(bool is_mesh) {
  const Vector3 half(kTile / 2, kTile, kTileHeight / 2);
  if (!is_mesh) return std::make_shared<Box>(half);
  return std::make_shared<TriangleMesh>(box_mesh(half).mesh());
}

void add_tiles(World& world, bool is_mesh, Scalar friction) {
  for (int i = -1; i < 6; ++i) {
    BodyDefinition body;
    body.kind = BodyKind::Static;
    body.shape = tile(is_mesh);
    body.friction = friction;
    body.initial.X_WB = RigidPose(Vector3((i + 0.5) * kTile, 0, -kTileHeight / 2));
    world.add_body(body);
  }
}

// A round tube along z, of facets inside and outside.
std::shared_ptr<const Shape> tube(int facets, Scalar inner, Scalar outer, Scalar length) {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  for (const auto& [radius, z] : {std::pair(inner, -length / 2), std::pair(inner, length / 2),
                                  std::pair(outer, length / 2), std::pair(outer, -length / 2)}) {
    for (int k = 0; k < facets; ++k) {
      const Scalar angle = 2 * std::numbers::pi * k / facets;
      vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  for (int ring = 0; ring < 4; ++ring) {
    for (int k = 0; k < facets; ++k) {
      const auto at = [&](int i, int j) { return i % 4 * facets + j % facets; };
      triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
  }
  return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
}

// A body that moves along x at kSpeed over tiles, for half a unit of time.
MotionState after_tiles(const std::shared_ptr<const Shape>& shape, Scalar height, Scalar spin,
                        bool is_mesh, Scalar friction, Scalar yaw, Scalar h) {
  WorldOptions options;
  options.gravity_W = Vector3(0, 0, -kGravity);
  World world(options);
  add_tiles(world, is_mesh, friction);
  BodyDefinition body;
  body.shape = shape;
  body.mass_properties = shape->compute_mass_properties(1000);
  body.friction = friction;
  body.initial.X_WB =
      RigidPose(rotation_from_vector(yaw * Vector3::UnitZ()), Vector3(kTile / 2, 0, height + 1e-4));
  body.initial.twist = {kSpeed * Vector3::UnitX(), spin * Vector3::UnitY()};
  const BodyId id = world.add_body(body);
  for (int k = 0; k < int(std::lround(0.5 / h)); ++k) world.advance(h);
  return world.state(id);
}

TEST(Seam, DoesNotStopBoxesAndPucksThatSlide) {
  const auto box = std::make_shared<Box>(Vector3(0.15, 0.1, 0.05));
  const auto puck = std::make_shared<Cylinder>(0.1, 0.05);
  for (const bool is_mesh : {false, true}) {
    for (const Scalar friction : {0., 0.3}) {
      for (const Scalar h : {0.01, 0.002, 0.001}) {
        const Scalar expected = kSpeed - 0.5 * friction * kGravity;
        const MotionState slid = after_tiles(box, 0.05, 0, is_mesh, friction, 0.4, h);
        EXPECT_NEAR(slid.twist.v_WB.x(), expected, 1e-3) << is_mesh << friction << h;
        EXPECT_LT(slid.twist.w_WB.norm(), 1e-3) << is_mesh << friction << h;
        const MotionState puck_slid = after_tiles(puck, 0.05, 0, is_mesh, friction, 0, h);
        EXPECT_NEAR(puck_slid.twist.v_WB.x(), expected, 1e-3) << is_mesh << friction << h;
      }
    }
  }
}

TEST(Seam, HardlyStopsBallsThatRoll) {
  const auto ball = std::make_shared<Sphere>(0.05);
  for (const bool is_mesh : {false, true}) {
    for (const Scalar friction : {0., 0.3}) {
      for (const Scalar h : {0.01, 0.002}) {
        const MotionState rolled = after_tiles(ball, 0.05, kSpeed / 0.05, is_mesh, friction, 0, h);
        EXPECT_NEAR(rolled.twist.v_WB.x(), kSpeed, 0.005 * kSpeed) << is_mesh << friction << h;
      }
    }
  }
}

// Of two rest gaps, no gravity: nothing touches.
TEST(Seam, LetsABoxGlideIntoASlotThatFits) {
  for (const Scalar clearances : {1.05, 2.}) {
    for (const Scalar h : {0.01, 0.002, 0.0005}) {
      WorldOptions options;
      options.gravity_W = Vector3::Zero();
      World world(options);
      BodyDefinition glider;
      glider.shape = std::make_shared<Box>(Vector3(0.1, 0.1, 0.1));
      glider.mass_properties = glider.shape->compute_mass_properties(1);
      glider.friction = 0;
      glider.initial.X_WB = RigidPose(Vector3(-0.5, 0, 0));
      glider.initial.twist.v_WB = Vector3::UnitX();
      const BodyId id = world.add_body(glider);
      const Scalar clearance = clearances * 1e-4;
      for (const Scalar side : {-1., 1.}) {
        BodyDefinition wall;
        wall.kind = BodyKind::Static;
        wall.shape = std::make_shared<Box>(Vector3(0.5, 0.5, 0.1));
        wall.friction = 0;
        wall.initial.X_WB = RigidPose(Vector3(0.5, 0, side * (0.2 + clearance)));
        world.add_body(wall);
      }
      for (int k = 0; k < int(std::lround(1 / h)); ++k) world.advance(h);
      EXPECT_NEAR(world.state(id).twist.v_WB.x(), 1, 1e-6) << clearances << " " << h;
    }
  }
}

// Contacts of hits push along the line through a ball's centre.
TEST(Seam, FrictionlessBallInATubeDoesNotSpin) {
  for (const Scalar h : {0.02, 0.01, 0.002}) {
    WorldOptions options;
    options.gravity_W = Vector3(0, -kGravity, 0);
    World world(options);
    BodyDefinition wall;
    wall.kind = BodyKind::Static;
    wall.shape = tube(256, 0.401, 0.5, 0.2);
    wall.friction = 0;
    world.add_body(wall);
    BodyDefinition ball;
    ball.shape = std::make_shared<Sphere>(0.05);
    ball.mass_properties = ball.shape->compute_mass_properties(8000);
    ball.friction = 0;
    const Scalar angle = 0.1;
    ball.initial.X_WB = RigidPose(0.3505 * Vector3(std::cos(angle), std::sin(angle), 0));
    const BodyId id = world.add_body(ball);
    for (int k = 0; k < int(std::lround(1 / h)); ++k) world.advance(h);
    EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-9) << h;
  }
}

}  // namespace
}  // namespace dyop
