// SPDX-License-Identifier: BSD-3-Clause

// Joints that close a loop and do not quite fit together, as rounded coordinates leave them: the
// mechanism moves as if they did, and gets no energy from what stays open.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

const Matrix3 kAlongY = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));

BodyId add_post(World& world) {
  BodyDefinition post;
  post.name = "post";
  post.kind = BodyKind::Static;
  post.shape = std::make_shared<Sphere>(0.01);
  return world.add_body(post);
}

BodyDefinition ghost(const Vector3& half, const RigidPose& X_WB) {
  BodyDefinition body = dynamic_body("", std::make_shared<Box>(half), Vector3::Zero());
  body.name.clear();
  body.initial.X_WB = X_WB;
  body.filter.mask = 0;
  return body;
}

Scalar energy(const World& world, const std::vector<BodyId>& ids) {
  Scalar sum = world.kinetic_energy();
  for (const BodyId id : ids) {
    sum += world.body(id).mass_properties.mass * kGravity * world.state(id).X_WB.translation().z();
  }
  return sum;
}

// A mechanism that starts at rest, and the most energy that it ever has more than then.
struct WatchedRun {
  explicit WatchedRun(World& world_in, std::vector<BodyId> ids_in)
      : world(world_in), ids(std::move(ids_in)), start(energy(world, ids)) {}
  void step(Scalar h) {
    const AdvanceReport report = world.advance(h);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    stalls += report.work.stalls;
    gain = std::max(gain, energy(world, ids) - start);
  }

  World& world;
  std::vector<BodyId> ids;
  Scalar start;
  Scalar gain = 0;
  std::int64_t stalls = 0;
};

// A flap of 0.6 hangs on two hinges 0.6 apart; one is off the axis of the other, or turned.
void expect_door_swings(Scalar shift, Scalar turn) {
  constexpr Scalar kAngle = 0.4;
  World world(earth_options());
  const BodyId post = add_post(world);
  const Matrix3 R = rotation_from_vector(Vector3(0, -kAngle, 0));
  const BodyId flap =
      world.add_body(ghost(Vector3(0.02, 0.4, 0.3), RigidPose(R, R * Vector3(0, 0, -0.3))));
  for (const Scalar side : {-1., 1.}) {
    JointDefinition hinge;
    hinge.name = side < 0 ? "left" : "right";
    hinge.kind = JointKind::Hinge;
    hinge.a = post;
    hinge.b = flap;
    const bool is_off = side > 0;
    hinge.X_AJ = RigidPose(rotation_from_vector((is_off ? turn : 0) * Vector3::UnitZ()) * kAlongY,
                           Vector3(is_off ? shift : 0, 0.3 * side, 0));
    hinge.X_BJ = RigidPose(kAlongY, Vector3(0, 0.3 * side, 0.3));
    world.add_joint(hinge);
  }
  const MassProperties& mass = world.body(flap).mass_properties;
  WatchedRun run(world, {flap});
  // The quarter period of a pendulum, by the arithmetic-geometric mean.
  Scalar a = 1;
  Scalar b = std::cos(kAngle / 2);
  for (int k = 0; k < 6; ++k) {
    const Scalar mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  const Scalar inertia = mass.I_BBcm(1, 1) + mass.mass * 0.09;
  const Scalar quarter = std::numbers::pi / 2 / a / std::sqrt(mass.mass * kGravity * 0.3 / inertia);
  constexpr Scalar kStep = 0.01;
  const auto angle = [&] {
    const Vector3 up = world.state(flap).X_WB.rotation().col(2);
    return std::atan2(-up.x(), up.z());
  };
  Scalar crossed = 0;
  Scalar last = angle();
  for (int k = 1; k <= 200; ++k) {
    run.step(kStep);
    const Scalar now = angle();
    if (crossed == 0 && now < 0) crossed = kStep * (k + now / (last - now));
    last = now;
  }
  EXPECT_NEAR(crossed, quarter, 1e-3) << shift << " " << turn;
  EXPECT_LT(run.gain, 1e-3 * mass.mass * kGravity * 0.3) << shift << " " << turn;
  EXPECT_EQ(run.stalls, 0);
}

TEST(Misfit, DoorOnTwoHingesSwings) {
  for (const Scalar misfit : {0., 1e-12, 1e-9, 1e-6, 1e-4, 1e-3}) {
    expect_door_swings(misfit, 0);
    expect_door_swings(0, misfit);
  }
}

// Rounded joints of closed chains of 4 and 12 links.
TEST(Misfit, ClosedChainGainsNoEnergy) {
  for (const int count : {4, 12}) {
    for (const Scalar misfit : {1e-9, 1e-6, 1e-4}) {
      World world(earth_options());
      const BodyId post = add_post(world);
      std::minstd_rand random(1);
      const auto draw = [&] { return 2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1; };
      const Scalar radius = 0.1 / std::sin(std::numbers::pi / count);
      const auto corner = [&](int k) {
        const Scalar angle = 2 * std::numbers::pi * k / count;
        return Vector3(radius * std::sin(angle), 0, radius * (std::cos(angle) - 1));
      };
      std::vector<BodyId> links;
      for (int k = 0; k < count; ++k) {
        const Vector3 along = corner(k + 1) - corner(k);
        const Matrix3 R = rotation_from_vector(Vector3(0, std::atan2(-along.z(), along.x()), 0));
        links.push_back(world.add_body(
            ghost(Vector3(0.09, 0.05, 0.02), RigidPose(R, (corner(k) + corner(k + 1)) / 2))));
      }
      for (int k = 0; k < count; ++k) {
        JointDefinition hinge;
        hinge.name = std::to_string(k);
        hinge.kind = JointKind::Hinge;
        hinge.a = links[std::size_t(k)];
        hinge.b = links[std::size_t((k + 1) % count)];
        hinge.X_AJ = RigidPose(kAlongY, Vector3(0.1, 0, 0));
        const Vector3 turn(draw(), draw(), draw());
        hinge.X_BJ = RigidPose(rotation_from_vector(misfit * turn) * kAlongY, Vector3(-0.1, 0, 0));
        world.add_joint(hinge);
      }
      JointDefinition hang;
      hang.name = "hang";
      hang.kind = JointKind::Hinge;
      hang.a = post;
      hang.b = links.front();
      hang.X_AJ = RigidPose(kAlongY, Vector3::Zero());
      hang.X_BJ = RigidPose(kAlongY, Vector3(-0.1, 0, 0));
      world.add_joint(hang);
      WatchedRun run(world, links);
      for (int k = 0; k < 100; ++k) run.step(0.01);
      const Scalar weight = world.body(links.front()).mass_properties.mass * kGravity;
      EXPECT_LT(run.gain, 1e-4 * weight * 0.2) << count << " " << misfit;
      EXPECT_EQ(run.stalls, 0);
    }
  }
}

// A straight row of links between two posts that are too near: the row has to give way sideways,
// and all its joints close while it sags.
TEST(Misfit, CompressedRowSags) {
  constexpr int kLinks = 3;
  constexpr Scalar kLink = 0.2;
  for (const Scalar overlap : {0.005, 0.05}) {
    for (const Scalar h : {0.01, 0.002}) {
      World world(earth_options());
      const BodyId post = add_post(world);
      std::vector<BodyId> links;
      const Scalar pitch = kLink * (1 - overlap);
      for (int k = 0; k < kLinks; ++k) {
        links.push_back(world.add_body(
            ghost(Vector3(0.4 * kLink, 0.02, 0.02), RigidPose(Vector3((k + 0.5) * pitch, 0, 0)))));
      }
      for (int k = 0; k <= kLinks; ++k) {
        JointDefinition hinge;
        hinge.name = std::to_string(k);
        hinge.kind = JointKind::Hinge;
        const bool is_last = k == kLinks;
        hinge.a = k == 0 || is_last ? post : links[std::size_t(k - 1)];
        hinge.b = links[std::size_t(is_last ? k - 1 : k)];
        hinge.X_AJ = RigidPose(kAlongY, Vector3(k == 0    ? 0
                                                : is_last ? k * pitch
                                                          : kLink / 2,
                                                0, 0));
        hinge.X_BJ = RigidPose(kAlongY, Vector3(is_last ? kLink / 2 : -kLink / 2, 0, 0));
        world.add_joint(hinge);
      }
      WatchedRun run(world, links);
      for (int k = 0; k < int(std::lround(3 / h)); ++k) run.step(h);
      const Scalar weight = world.body(links.front()).mass_properties.mass * kGravity;
      EXPECT_LT(run.gain, 1e-3 * weight * kLink) << overlap << " " << h;
      EXPECT_EQ(run.stalls, 0);
      EXPECT_LT(world.state(links[1]).X_WB.translation().z(), -0.01) << overlap << " " << h;
    }
  }
}

// Closing the offset of a joint leaves two bodies at rest where it brings them.
TEST(Misfit, ClosingAnOffsetGivesNoSpeed) {
  for (const JointKind kind : {JointKind::Fixed, JointKind::Ball, JointKind::Slider}) {
    for (const Scalar h : {0.02, 0.002}) {
      World world{WorldOptions{}};
      const Vector3 half(0.1, 0.1, 0.1);
      JointDefinition joint;
      joint.name = "joint";
      joint.kind = kind;
      joint.a = world.add_body(ghost(half, RigidPose(Vector3(-0.15, 0, 0))));
      joint.b = world.add_body(ghost(half, RigidPose(Vector3(0.25, 0, 0.1))));
      joint.X_AJ = RigidPose(Vector3(0.15, 0, 0));
      joint.X_BJ = RigidPose(Vector3(-0.15, 0, 0));
      world.add_joint(joint);
      for (int k = 0; k < int(std::lround(1 / h)); ++k) world.advance(h);
      EXPECT_LT(world.kinetic_energy(), 1e-20) << int(kind) << " " << h;
      EXPECT_LT(world.angular_momentum().norm(), 1e-12) << int(kind) << " " << h;
    }
  }
}

}  // namespace
}  // namespace dyop
