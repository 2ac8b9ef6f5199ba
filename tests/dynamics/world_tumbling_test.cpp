// SPDX-License-Identifier: BSD-3-Clause

// A body that turns by a large part of a radian in a step, with an end at the ground: within the
// step that end comes down and goes up again, so that its gap after the step is not the least.
#include <gtest/gtest.h>

#include <memory>

#include "dyop/geometry/primitives.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

BodyDefinition placed_body(std::shared_ptr<const Shape> shape, Scalar mass, const Vector3& p,
                           const Quaternion& q, const Vector3& v, const Vector3& w) {
  BodyDefinition body = dynamic_body("body", std::move(shape), p, v, w);
  body.mass_properties =
      body.shape->compute_mass_properties(mass / body.shape->compute_mass_properties(1).mass);
  body.initial.X_WB = RigidPose(q.normalized().toRotationMatrix(), p);
  return body;
}

// A capsule on a stiff, damped spring is whirled round and strikes the ground with its ends, as in
// a random world where it stood still for the rest of a step; velocities are varied.
TEST(WorldTumbling, ABodyThatTurnsFastIsNotStopped) {
  std::mt19937_64 random(71);
  std::int64_t substeps = 0;
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(::testing::Message() << "scene " << i);
    WorldOptions options;
    options.gravity_W = Vector3(0, 0, -10);
    World world(options);
    world.add_body(floor_body(0.2188));
    SpringDefinition spring;
    spring.name = "spring";
    spring.a = world.add_body(placed_body(std::make_shared<Sphere>(0.3442), 790.2,
                                          Vector3(-2.5734, -2.0275, 1.4174), Quaternion::Identity(),
                                          Vector3(-1.9847, -1.5578, -3.871), Vector3::Zero()));
    BodyDefinition capsule = placed_body(
        std::make_shared<Capsule>(0.1047, 0.10413), 29.525, Vector3(-2.46652, -1.44491, 0.19748),
        Quaternion(0.94511, 0.10608, -0.20931, 0.22737),
        Vector3(-5.2836, 5.6449, -0.0877) + random_vector(0.5, random),
        Vector3(-29.1244, -27.2154, 2.8981) + random_vector(3, random));
    capsule.friction = 0.9349;
    spring.b = world.add_body(capsule);
    spring.rest_length = random_number(1, 1.5, random);
    spring.stiffness = 2.1424e6;
    spring.damping = 599.3;
    world.add_spring(spring);
    for (int k = 0; k < 3; ++k) {
      const AdvanceReport report = world.advance(0.01);
      EXPECT_EQ(report.status, AdvanceStatus::Completed);
      EXPECT_EQ(report.work.stalls, 0) << "step " << k;
      EXPECT_TRUE(report.too_near.empty());
      substeps += report.work.substeps;
    }
  }
  EXPECT_EQ(substeps, 300);  // none is cut
}

}  // namespace
}  // namespace dyop
