// SPDX-License-Identifier: BSD-3-Clause

// Bodies that fit closely into others: pins in holes, boxes in slots and in a row. The play may be
// less than two rest gaps; it is free play as long as it is more than the target distance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kPinRadius = 0.3;
constexpr Scalar kThickness = 0.2;

// Quads between rings of points, and from the last to the first.
TriangleMesh ring_mesh(const std::vector<std::vector<Vector3>>& rings) {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  const int count = int(rings.front().size());
  const int rows = int(rings.size());
  for (const auto& ring : rings) vertices.insert(vertices.end(), ring.begin(), ring.end());
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < count; ++k) {
      const int next = (k + 1) % count;
      const int a = i * count + k;
      const int b = i * count + next;
      const int c = (i + 1) % rows * count + next;
      const int d = (i + 1) % rows * count + k;
      triangles.push_back({a, b, c});
      triangles.push_back({a, c, d});
    }
  }
  return {vertices, triangles};
}

std::vector<Vector3> circle(int count, Scalar radius, Scalar stretched, Scalar z) {
  std::vector<Vector3> ring;
  for (int k = 0; k < count; ++k) {
    const Scalar angle = 2 * std::numbers::pi * k / count;
    const Scalar c = std::cos(angle);
    const Scalar r = c > 0 ? radius + (stretched - radius) * c * c * c * c : radius;
    ring.emplace_back(r * c, radius * std::sin(angle), z);
  }
  return ring;
}

// A plate with a round hole of 48 facets about the z axis, whose outline reaches out to x = 1.5.
std::shared_ptr<const TriangleMesh> plate_with_hole(Scalar play) {
  const Scalar hole = kPinRadius + play;
  return std::make_shared<TriangleMesh>(
      ring_mesh({circle(48, hole, hole, 0), circle(48, 0.6, 1.5, 0),
                 circle(48, 0.6, 1.5, kThickness), circle(48, hole, hole, kThickness)}));
}

// A pin of 64 facets.
std::shared_ptr<const TriangleMesh> faceted_pin() {
  std::vector<std::vector<Vector3>> rings;
  for (const Scalar z : {-3., -1., 1., 3.}) {
    rings.push_back(circle(64, kPinRadius, kPinRadius, z));
  }
  return std::make_shared<TriangleMesh>(ring_mesh({
      rings[3],
      rings[2],
      rings[1],
      rings[0],
      circle(64, kPinRadius / 10, kPinRadius / 10, -3),
      circle(64, kPinRadius / 10, kPinRadius / 10, 3),
  }));
}

// Turning angle about an axis at x = y = 0 after a time, from rest, without friction.
Scalar pendulum_angle(const MassProperties& mass, Scalar time) {
  const Vector3 arm(mass.p_BoBcm.x(), mass.p_BoBcm.y(), 0);
  const Scalar inertia = mass.I_BBcm(2, 2) + mass.mass * arm.squaredNorm();
  const Scalar rate = mass.mass * kGravity / inertia;
  Scalar angle = 0;
  Scalar speed = 0;
  constexpr int kSteps = 100000;
  const Scalar h = time / kSteps;
  for (int k = 0; k < kSteps; ++k) {  // leapfrog
    speed -= h * rate * (arm.x() * std::cos(angle) - arm.y() * std::sin(angle));
    angle += h * speed;
  }
  return angle;
}

struct Pendulum {
  explicit Pendulum(std::shared_ptr<const Shape> pin, Scalar play,
                    std::optional<Scalar> rest_offset)
      : world([&] {
          WorldOptions options;
          options.gravity_W = Vector3(0, -kGravity, 0);
          options.rest_offset = rest_offset;
          return options;
        }()) {
    BodyDefinition fixed;
    fixed.kind = BodyKind::Static;
    fixed.name = "pin";
    fixed.shape = std::move(pin);
    fixed.friction = 0;
    world.add_body(fixed);
    BodyDefinition body = dynamic_body("plate", plate_with_hole(play), Vector3::Zero());
    body.friction = 0;
    body.restitution = 0;
    mass = body.mass_properties;
    plate = world.add_body(body);
  }

  Scalar angle() const {
    const Matrix3 R = world.state(plate).X_WB.rotation();
    return std::atan2(R(1, 0), R(0, 0));
  }

  World world;
  MassProperties mass;
  BodyId plate;
};

constexpr Scalar kTime = 0.6;

TEST(CloseFit, APlateSwingsOnAFacetedPinAsAPendulumDoes) {
  for (const Scalar play : {1e-2, 3e-3, 1e-3}) {
    for (const std::optional<Scalar> rest_offset :
         {std::optional<Scalar>{}, std::optional<Scalar>{1e-4}}) {
      Pendulum pendulum(faceted_pin(), play, rest_offset);
      std::int64_t unconverged = 0;
      for (int k = 0; k < 120; ++k) unconverged += pendulum.world.advance(0.005).work.unconverged;
      const Scalar expected = pendulum_angle(pendulum.mass, kTime);
      EXPECT_NEAR(pendulum.angle(), expected, 0.015 * std::abs(expected)) << "play " << play;
      EXPECT_EQ(unconverged, 0) << "play " << play;
      EXPECT_FALSE(pendulum.world.is_asleep(pendulum.plate));
    }
  }
}

TEST(CloseFit, APlateSwingsOnARoundPinAsAPendulumDoes) {
  for (const Scalar play : {1e-3}) {
    Pendulum pendulum(std::make_shared<Cylinder>(kPinRadius, 3), play, std::nullopt);
    for (int k = 0; k < 60; ++k) pendulum.world.advance(0.01);
    const Scalar expected = pendulum_angle(pendulum.mass, kTime);
    EXPECT_NEAR(pendulum.angle(), expected, 0.01 * std::abs(expected)) << "play " << play;
  }
}

// A ball in a hollow sphere of 1,280 triangles, whose centre of mass is off its middle. Hundreds of
// triangles are near.
TEST(CloseFit, ABallTurnsInItsSocketAsAPendulumDoes) {
  constexpr Scalar kBallRadius = 0.3;
  constexpr Scalar kOffset = 0.1;
  for (const Scalar play : {3e-3, 3e-4}) {
    World world(earth_options());
    BodyDefinition socket;
    socket.name = "socket";
    socket.kind = BodyKind::Static;
    socket.friction = 0;
    const TriangleMesh sphere = icosphere(3).mesh();
    Scalar inner = kInfinity;  // radius of the ball that fits inside
    for (const TriangleIndices& t : sphere.triangles()) {
      const auto corner = [&](int k) -> Vector3 {
        return sphere.vertices()[std::size_t(t[std::size_t(k)])];
      };
      const Vector3 n = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
      inner = std::min(inner, std::abs(n.dot(corner(0))));
    }
    socket.shape =
        std::make_shared<TriangleMesh>(icosphere(3, (kBallRadius + play) / inner).mesh());
    world.add_body(socket);
    BodyDefinition ball =
        dynamic_body("ball", std::make_shared<Sphere>(kBallRadius), Vector3::Zero());
    ball.friction = 0;
    ball.restitution = 0;
    ball.mass_properties.p_BoBcm = Vector3(kOffset, 0, 0);
    const BodyId id = world.add_body(ball);
    for (int k = 0; k < 30; ++k) world.advance(0.01);
    // The pendulum of pendulum_angle() swings about z, with gravity along -y.
    const Scalar expected = pendulum_angle(ball.mass_properties, 0.3);
    const Vector3 arm_W = world.state(id).X_WB.rotation() * Vector3::UnitX();
    EXPECT_NEAR(std::atan2(arm_W.z(), arm_W.x()), expected, 0.01 * std::abs(expected)) << play;
  }
}

// Boxes side by side between two walls, with this much play at each of their sides.
std::vector<BodyId> add_row(World& world, int count, Scalar play, Scalar friction) {
  const Scalar half_width = (count + (count + 1) * play) / 2;
  for (const Scalar side : {-1., 1.}) {
    BodyDefinition wall;
    wall.name = side < 0 ? "left wall" : "right wall";
    wall.kind = BodyKind::Static;
    wall.shape = std::make_shared<Box>(Vector3(0.5, 2, 5));
    wall.initial.X_WB = RigidPose(Vector3(side * (half_width + 0.5), 0, 0));
    wall.friction = friction;
    world.add_body(wall);
  }
  std::vector<BodyId> boxes;
  for (int k = 0; k < count; ++k) {
    const Scalar x = -half_width + 0.5 + play + k * (1 + play);
    BodyDefinition box = dynamic_body("box " + std::to_string(k),
                                      std::make_shared<Box>(Vector3(0.5, 0.5, 0.5)), {x, 0, 2});
    box.friction = friction;
    box.restitution = 0;
    boxes.push_back(world.add_body(box));
  }
  return boxes;
}

// Nothing presses the boxes together, so nothing brakes them. With recovery of contradictory gaps
// something did, or threw them out.
TEST(CloseFit, BoxesFallFreelyBetweenWallsThatLeaveLessThanTheirRestGaps) {
  for (const int count : {1, 3}) {
    for (const Scalar friction : {0., 0.5}) {
      for (const Scalar play : {3e-4, 1e-3}) {
        World world(earth_options());
        const std::vector<BodyId> boxes = add_row(world, count, play, friction);
        for (int k = 0; k < 25; ++k) EXPECT_EQ(world.advance(0.01).work.stalls, 0);
        for (const BodyId box : boxes) {
          const MotionState state = world.state(box);
          const Scalar fallen = kGravity * 0.25 * 0.25 / 2;
          EXPECT_NEAR(state.X_WB.translation().z(), 2 - fallen, 1e-3 * fallen)
              << count << " boxes, friction " << friction << ", play " << play;
          EXPECT_NEAR(state.twist.w_WB.norm(), 0, 1e-3);
        }
      }
    }
  }
}

// Walls on prescribed motions, and walls that a joint connects and that fall with the box.
enum class Walls { AtRest, Moving, JoinedInFreeFall };

void expect_box_falls_between(Walls walls, Scalar friction, Scalar play) {
  World world(earth_options());
  std::vector<BodyId> ids;
  for (const Scalar side : {-1., 1.}) {
    const Vector3 place(side * (0.2 + play), 0, 0);
    BodyDefinition wall = dynamic_body(side < 0 ? "left wall" : "right wall",
                                       std::make_shared<Box>(Vector3(0.1, 1, 5)), place);
    wall.friction = friction;
    if (walls != Walls::JoinedInFreeFall) {
      wall.kind = BodyKind::Kinematic;
      wall.motion = std::make_shared<ConstantTwistMotion>(
          RigidPose(place),
          Twist{(walls == Walls::Moving ? 0.5 : 0) * Vector3::UnitY(), Vector3::Zero()});
    }
    ids.push_back(world.add_body(wall));
  }
  if (walls == Walls::JoinedInFreeFall) {
    JointDefinition frame;
    frame.name = "frame";
    frame.kind = JointKind::Fixed;
    frame.a = ids[0];
    frame.b = ids[1];
    frame.X_AJ = RigidPose(Vector3(0.2 + play, 0, 0));
    frame.X_BJ = RigidPose(Vector3(-0.2 - play, 0, 0));
    world.add_joint(frame);
  }
  BodyDefinition box =
      dynamic_body("box", std::make_shared<Box>(Vector3(0.1, 0.1, 0.1)), Vector3::Zero());
  box.friction = friction;
  box.restitution = 0;
  const BodyId id = world.add_body(box);
  for (int k = 0; k < 30; ++k) EXPECT_EQ(world.advance(0.01).work.unconverged, 0);
  const Scalar fallen = kGravity * 0.3 * 0.3 / 2;
  EXPECT_NEAR(world.state(id).X_WB.translation().z(), -fallen, 1e-3 * fallen)
      << int(walls) << ", friction " << friction << ", play " << play;
}

TEST(CloseFit, BoxesFallFreelyBetweenWallsThatMoveOrAreJoined) {
  for (const Walls walls : {Walls::AtRest, Walls::Moving, Walls::JoinedInFreeFall}) {
    for (const Scalar friction : {0., 0.5}) {
      for (const Scalar play : {2e-4, 6e-5, 3e-5}) {
        if (walls == Walls::Moving && friction > 0) continue;  // drag along
        expect_box_falls_between(walls, friction, play);
      }
    }
  }
}

// A carriage on a rail passes above a floor that is nearer than its rest gap.
TEST(CloseFit, ACarriageGlidesCloseAboveAFloor) {
  for (const Scalar gaps : {0.3, 0.6, 0.9}) {
    for (const Scalar h : {0.01, 0.002}) {
      World world(earth_options());
      const BodyId floor = world.add_body(floor_body(0.5));
      constexpr Scalar kHalf = 0.1;
      const Scalar height = kHalf + gaps * rest_gap(kHalf * std::sqrt(3.));
      BodyDefinition carriage =
          dynamic_body("carriage", std::make_shared<Box>(Vector3(kHalf, kHalf, kHalf)),
                       {0, 0, height}, {2, 0, 0});
      carriage.friction = 0.5;
      const BodyId id = world.add_body(carriage);
      JointDefinition rail;
      rail.name = "rail";
      rail.kind = JointKind::Slider;
      rail.a = floor;
      rail.b = id;
      const Matrix3 z_to_x = rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0));
      rail.X_AJ = RigidPose(z_to_x, Vector3(0, 0, 1 + height));
      rail.X_BJ = RigidPose(z_to_x, Vector3::Zero());
      world.add_joint(rail);
      for (int k = 0; k < int(std::lround(0.3 / h)); ++k) {
        EXPECT_EQ(world.advance(h).work.unconverged, 0);
      }
      EXPECT_NEAR(world.state(id).twist.v_WB.x(), 2, 1e-6) << gaps << " " << h;
    }
  }
}

}  // namespace
}  // namespace dyop
