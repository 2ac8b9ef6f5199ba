// SPDX-License-Identifier: BSD-3-Clause

// Bodies that hit something within a step while a floor bears them: what is symmetric stays so, and
// what nothing turns keeps its spin.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kRollSpeed = 3;
constexpr Scalar kRollerRadius = 0.1;
constexpr Scalar kRollSpin = kRollSpeed / kRollerRadius;

// A round body that lies along y on a floor and rolls along x against a wall, for 0.4 units of time.
MotionState rolled_into_wall(const std::shared_ptr<const Shape>& shape, Scalar friction, Scalar x,
                             Scalar h) {
  World world(earth_options());
  world.add_body(floor_body(friction));
  BodyDefinition wall;
  wall.name = "wall";
  wall.kind = BodyKind::Static;
  wall.shape = std::make_shared<Box>(Vector3(0.2, 1, 0.5));
  wall.initial.X_WB = RigidPose(Vector3(1.2, 0, 0.5));
  wall.friction = friction;
  world.add_body(wall);
  BodyDefinition roller = dynamic_body("roller", shape, {x, 0, kRollerRadius + 4e-5},
                                       {kRollSpeed, 0, 0}, {0, kRollSpin, 0});
  roller.initial.X_WB = RigidPose(rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0)),
                                  roller.initial.X_WB.translation());
  roller.friction = friction;
  roller.restitution = 0;
  const BodyId id = world.add_body(roller);
  for (int k = 0; k < int(std::lround(0.4 / h)); ++k) world.advance(h);
  return world.state(id);
}

TEST(HitContacts, ACylinderThatMeetsAWallAlongALineDoesNotTurn) {
  const auto cylinder = std::make_shared<Cylinder>(kRollerRadius, 0.2);
  for (const Scalar friction : {0., 0.4, 1.}) {
    for (const Scalar x : {0., 0.0137}) {
      for (const Scalar h : {0.002, 0.005, 0.0085, 0.011, 0.02}) {
        const Vector3 w = rolled_into_wall(cylinder, friction, x, h).twist.w_WB;
        EXPECT_LT(std::abs(w.x()) + std::abs(w.z()), 1e-6) << friction << " " << x << " " << h;
      }
    }
  }
}

TEST(HitContacts, NothingTurnsASmoothRollerWithoutFriction) {
  for (const std::shared_ptr<const Shape>& shape :
       {std::shared_ptr<const Shape>(std::make_shared<Cylinder>(kRollerRadius, 0.2)),
        std::shared_ptr<const Shape>(
            std::make_shared<Ellipsoid>(Vector3(kRollerRadius, kRollerRadius, 0.2))),
        std::shared_ptr<const Shape>(std::make_shared<CompoundShape>(std::vector<CompoundChild>{
            {std::make_shared<Cylinder>(kRollerRadius, 0.1), RigidPose(Vector3(0, 0, 0.1))},
            {std::make_shared<Cylinder>(kRollerRadius, 0.1), RigidPose(Vector3(0, 0, -0.1))}})),
        std::shared_ptr<const Shape>(std::make_shared<Capsule>(kRollerRadius, 0.2))}) {
    for (const Scalar x : {0., 0.0137}) {
      for (const Scalar h : {0.002, 0.005, 0.0085, 0.011, 0.02}) {
        const Vector3 w = rolled_into_wall(shape, 0, x, h).twist.w_WB;
        EXPECT_NEAR(w.y(), kRollSpin, 1e-3 * kRollSpin) << x << " " << h;
      }
    }
  }
}

// A round child of a compound bounces like the shape itself.
TEST(HitContacts, AFlatDropOfACompoundReboundsWithoutTurning) {
  for (const bool is_lying : {false, true}) {
    for (const Scalar h : {0.003, 0.01}) {
      World world(earth_options());
      BodyDefinition floor = floor_body(0.4);
      floor.restitution = 0.8;
      world.add_body(floor);
      const RigidPose X_CS(Vector3(0.02, 0.03, -0.05));
      const auto wheel = std::make_shared<CompoundShape>(
          std::vector<CompoundChild>{{std::make_shared<Cylinder>(0.1, 0.2), X_CS}});
      const Scalar up = is_lying ? 0.1 : 0.2;
      const Matrix3 R_WC = is_lying ? rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0))
                                    : Matrix3(Matrix3::Identity());
      BodyDefinition body = dynamic_body("wheel", wheel, Vector3::Zero());
      body.initial.X_WB = RigidPose(R_WC, Vector3(0, 0, up + 0.3)) * X_CS.inverse();
      body.friction = 0.4;
      body.restitution = 0.8;
      const BodyId id = world.add_body(body);
      const auto height = [&] { return (world.state(id).X_WB * X_CS).translation().z() - up; };
      Scalar highest = 0;
      for (Scalar t = 0; t < 0.45; t += h) {
        world.advance(h);
        if (t > 0.26) highest = std::max(highest, height());
      }
      EXPECT_NEAR(highest, 0.8 * 0.8 * 0.3, 2e-3) << is_lying << " " << h;
      EXPECT_LT(world.state(id).twist.w_WB.norm(), 1e-9) << is_lying << " " << h;
    }
  }
}

}  // namespace
}  // namespace dyop
