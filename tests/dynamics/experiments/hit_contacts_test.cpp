// SPDX-License-Identifier: BSD-3-Clause

// Bodies that hit something within a step while a floor bears them: what is symmetric stays so, and
// what nothing turns keeps its spin.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

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
        std::shared_ptr<const Shape>(std::make_shared<Capsule>(kRollerRadius, 0.2))}) {
    for (const Scalar x : {0., 0.0137}) {
      for (const Scalar h : {0.002, 0.005, 0.0085, 0.011, 0.02}) {
        const Vector3 w = rolled_into_wall(shape, 0, x, h).twist.w_WB;
        EXPECT_NEAR(w.y(), kRollSpin, 1e-3 * kRollSpin) << x << " " << h;
      }
    }
  }
}

}  // namespace
}  // namespace dyop
