// SPDX-License-Identifier: BSD-3-Clause

// Needles, pens and rods: so light to turn about their axes that what is a small error for a cube is
// a wild spin for them. They gain no energy, keep their spin without friction, and bounce twice in a
// step where they would.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/world_scenes.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;

struct Surface {
  Scalar friction = 0;
  Scalar restitution = 0;
};

BodyDefinition thrown(const std::shared_ptr<const Shape>& shape, const Vector3& p, Scalar speed,
                      Scalar turning, const Surface& surface, std::mt19937_64& random) {
  BodyDefinition body = dynamic_body("thrown", shape, p, random_vector(speed, random),
                                     random_vector(turning, random));
  body.initial.X_WB = RigidPose(random_rotation(random).toRotationMatrix(), p);
  body.friction = surface.friction;
  body.restitution = surface.restitution;
  return body;
}

BodyDefinition ground(const Surface& surface) {
  BodyDefinition body = floor_body(surface.friction, surface.restitution);
  body.shape = std::make_shared<HalfSpace>();
  body.initial.X_WB = RigidPose();
  return body;
}

Scalar energy_of(const World& world, const std::vector<BodyId>& bodies) {
  Scalar sum = world.kinetic_energy();
  for (const BodyId& id : bodies) {
    const Scalar mass = world.body(id).mass_properties.mass;
    sum += mass * kGravity * world.state(id).X_WB.translation().z();
  }
  return sum;
}

// The least and the greatest change of the energy of `bodies` in one step of a run.
struct EnergyChanges {
  Scalar least = 0;
  Scalar greatest = 0;
};

EnergyChanges energy_changes(World& world, const std::vector<BodyId>& bodies, Scalar h, Scalar t) {
  EnergyChanges changes;
  Scalar before = energy_of(world, bodies);
  for (int k = 0; k < std::lround(t / h); ++k) {
    EXPECT_EQ(world.advance(h).status, AdvanceStatus::Completed);
    const Scalar after = energy_of(world, bodies);
    changes.least = std::min(changes.least, after - before);
    changes.greatest = std::max(changes.greatest, after - before);
    before = after;
  }
  return changes;
}

/// One body thrown on a half-space, and the energy that lifts it by 1.
struct Throw {
  World world;
  BodyId id;
  Scalar weight = 0;
};

Throw thrown_alone(const std::shared_ptr<const Shape>& shape, const Surface& surface,
                   std::mt19937_64& random) {
  Throw result{World(earth_options()), {}, 0};
  result.world.add_body(ground(surface));
  result.id = result.world.add_body(thrown(shape, Vector3(0, 0, 0.4), 1, 6, surface, random));
  result.weight = kGravity * result.world.body(result.id).mass_properties.mass;
  return result;
}

const std::shared_ptr<const Shape>& rod() {
  static const std::shared_ptr<const Shape> shape =
      std::make_shared<Box>(Vector3(0.15, 0.01, 0.01));
  return shape;
}

// Energy once rose by 258 times what lifts all needles by 0.1.
TEST(ThinBodies, AHandfulOfNeedlesGainsNoEnergy) {
  const std::shared_ptr<const Shape> shapes[] = {std::make_shared<Capsule>(0.005, 0.15),
                                                 std::make_shared<Cylinder>(0.008, 0.15)};
  const Surface surfaces[] = {{0.2, 0.4}, {0.5, 0.4}, {0.5, 0}, {0, 0}};
  for (int i = 0; i < 48; ++i) {
    SCOPED_TRACE(i);
    std::mt19937_64 random(900 + static_cast<unsigned>(i));
    const Surface& surface = surfaces[i % 4];
    World world(earth_options());
    world.add_body(floor_body(surface.friction, surface.restitution));
    std::vector<BodyId> bodies;
    Scalar weight = 0;
    for (int k = 0; k < 4; ++k) {
      const Vector3 p(0.05 * random_number(-1, 1, random), 0.05 * random_number(-1, 1, random),
                      0.3 + 0.3 * k);
      bodies.push_back(world.add_body(thrown(shapes[i / 4 % 2], p, 0.5, 3, surface, random)));
      weight += kGravity * world.body(bodies.back()).mass_properties.mass;
    }
    const Scalar h = i % 3 == 0 ? 0.005 : 0.01;
    EXPECT_LT(energy_changes(world, bodies, h, 1.0).greatest, 0.005 * weight * 0.1);
  }
}

// Its energy once rose by 355 times what lifts it by half its length.
TEST(ThinBodies, AClatteringRodIsNotThrownUp) {
  const Surface surfaces[] = {{0, 0.5}, {0.5, 0.5}, {0.3, 0.9}, {0, 1}};
  for (int i = 0; i < 160; ++i) {
    SCOPED_TRACE(i);
    std::mt19937_64 random(static_cast<unsigned>(i));
    const Surface& surface = surfaces[i % 4];
    Throw scene = thrown_alone(rod(), surface, random);
    const Scalar h = i % 8 < 4 ? 0.01 : 0.02;
    EXPECT_LT(energy_changes(scene.world, {scene.id}, h, 1.5).greatest, 0.05 * scene.weight * 0.15);
  }
}

TEST(ThinBodies, AClatteringRodKeepsItsEnergy) {
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    std::mt19937_64 random(500 + static_cast<unsigned>(i));
    Throw scene = thrown_alone(rod(), {0, 1}, random);
    const EnergyChanges changes = energy_changes(scene.world, {scene.id}, 0.0025, 1.5);
    EXPECT_LT(changes.greatest, 0.02 * scene.weight * 0.15);
    EXPECT_GT(changes.least, -0.02 * scene.weight * 0.15);
  }
}

// What locks an axis does no work, however fast the body turns about the others and its inertia
// about them changes.
TEST(ThinBodies, ALockedAxisKeepsTheirEnergy) {
  std::mt19937_64 random(21);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(i);
    World world;
    BodyDefinition body = thrown(rod(), Vector3::Zero(), 1, 20, Surface{}, random);
    const auto locked = static_cast<std::size_t>(i % 3);
    body.locked.rotation[locked] = true;
    body.initial.twist.w_WB[i % 3] = 0;
    const BodyId id = world.add_body(body);
    const Scalar energy = world.kinetic_energy();
    run_for(world, 1);
    EXPECT_NEAR(world.kinetic_energy(), energy, 1e-5 * energy);
    EXPECT_EQ(world.state(id).twist.w_WB[i % 3], 0);
  }
}

// Every normal force on a round needle passes through its axis. Its spin once changed by thousands
// of radians per second.
TEST(ThinBodies, AFrictionlessNeedleKeepsItsSpin) {
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    std::mt19937_64 random(100 + static_cast<unsigned>(i));
    const Surface surface{0, i % 2 == 0 ? 0.8 : 0.0};
    World world(earth_options());
    world.add_body(i % 4 < 2 ? ground(surface) : floor_body(0, surface.restitution));
    std::shared_ptr<const Shape> needle = std::make_shared<Capsule>(0.005, 0.15);
    if (i % 3 == 0) needle = std::make_shared<Cylinder>(0.005, 0.15);
    const BodyId id = world.add_body(thrown(needle, Vector3(0, 0, 0.4), 0.3, 6, surface, random));
    const auto spin = [&] {
      const MotionState state = world.state(id);
      return state.twist.w_WB.dot(state.X_WB.rotation().col(2));
    };
    const Scalar before = spin();
    const Scalar h = i % 8 < 4 ? 0.01 : 0.0025;
    for (int k = 0; k < std::lround(1 / h); ++k) world.advance(h);
    EXPECT_NEAR(spin(), before, surface.restitution > 0 ? 2e-3 : 0.6);
  }
}

// A second corner that strikes in the same step bounces, too: it was once stopped.
TEST(ThinBodies, ABoxBouncesOnTwoCornersInAStep) {
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    std::mt19937_64 random(300 + static_cast<unsigned>(i));
    Throw scene = thrown_alone(std::make_shared<Box>(Vector3(0.1, 0.07, 0.05)), {0, 1}, random);
    const EnergyChanges changes = energy_changes(scene.world, {scene.id}, 0.01, 1.5);
    EXPECT_LT(changes.greatest, 0.01 * scene.weight * 0.1);
    EXPECT_GT(changes.least, -0.01 * scene.weight * 0.1);
  }
}

// Two bodies that turn and slide along or about an axis through neither's middle: where one passes
// close by the other they turn ever faster, like a skater who draws in the arms, and a step that is
// too long gains up to a tenth of the energy.
TEST(ThinBodies, SlidingPastEachOtherGainNoEnergy) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 400; ++i) {
    const std::vector<std::shared_ptr<const Shape>> shapes{
        std::make_shared<Box>(Vector3(0.1, 0.08, 0.003)),
        std::make_shared<Box>(Vector3(0.15, 0.015, 0.015))};
    World world;
    std::vector<BodyId> ids;
    for (const auto& shape : shapes) {
      ids.push_back(
          world.add_body(thrown(shape, random_vector(0.3, random), 2, 8, Surface{}, random)));
    }
    const RigidPose X_WA = world.state(ids[0]).X_WB;
    const RigidPose X_WB = world.state(ids[1]).X_WB;
    const RigidPose X_WJ(random_rotation(random).toRotationMatrix(),
                         (X_WA.translation() + X_WB.translation()) / 2);
    JointDefinition joint;
    joint.kind = i % 2 == 0 ? JointKind::Slider : JointKind::Cylindrical;
    joint.a = ids[0];
    joint.b = ids[1];
    joint.X_AJ = X_WA.inverse() * X_WJ;
    joint.X_BJ = X_WB.inverse() * X_WJ;
    world.add_joint(joint);
    run_for(world, 0.01);  // afterwards the velocities fit the joint
    Scalar energy = world.kinetic_energy();
    for (int k = 0; k < 30; ++k) {
      run_for(world, 0.01);
      EXPECT_LT(world.kinetic_energy(), (1 + 5e-3) * energy) << i << ", step " << k;
      energy = world.kinetic_energy();
    }
  }
}

}  // namespace
}  // namespace dyop
