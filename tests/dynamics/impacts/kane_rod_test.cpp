// SPDX-License-Identifier: BSD-3-Clause

// A rod that strikes a floor at an angle, with friction enough to stick: Newton's restitution alone
// would give it energy where it slides the way the floor is about to push it ([Kane1984]). The same
// on a floor that moves like a belt: nothing changes for who rides on it.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kKaneRadius = 0.02;
constexpr Scalar kKaneHalfLength = 0.5;

// Velocities of its lower tip along the floor and away from it, and the energy, before and after: all
// as seen from the floor.
struct KaneRod {
  Eigen::Vector2d before, after;
  Scalar energy_before = 0;
  Scalar energy_after = 0;
  Eigen::Matrix2d inertia;  // of the tip, along the floor and away from it
};

KaneRod strike(Scalar lean, Scalar sliding, Scalar restitution, Scalar belt_speed) {
  World world;
  BodyDefinition floor = floor_body(4, restitution);
  const Vector3 v_WF(belt_speed, 0, 0);
  if (belt_speed != 0) {
    floor.kind = BodyKind::Kinematic;
    floor.motion =
        std::make_shared<ConstantTwistMotion>(floor.initial.X_WB, Twist{v_WF, Vector3::Zero()});
  }
  world.add_body(floor);
  const auto shape = std::make_shared<Capsule>(kKaneRadius, kKaneHalfLength);
  const Vector3 p_tip(-kKaneHalfLength * std::sin(lean), 0,
                      -kKaneHalfLength * std::cos(lean) - kKaneRadius);
  BodyDefinition body = dynamic_body("rod", shape, {0, 0, 1e-3 - p_tip.z()},
                                     {sliding + belt_speed, 0, -1}, {0, 0, 0});
  body.initial.X_WB =
      RigidPose(rotation_from_vector(Vector3(0, lean, 0)), {0, 0, 1e-3 - p_tip.z()});
  body.friction = 4;
  body.restitution = restitution;
  const BodyId rod = world.add_body(body);
  KaneRod result;
  const Scalar mass = body.mass_properties.mass;
  const Scalar turning = body.mass_properties.I_BBcm(1, 1);
  Eigen::Matrix2d mobility;  // of a force at the tip
  mobility << 1 / mass + p_tip.z() * p_tip.z() / turning, -p_tip.x() * p_tip.z() / turning,
      -p_tip.x() * p_tip.z() / turning, 1 / mass + p_tip.x() * p_tip.x() / turning;
  result.inertia = mobility.inverse();
  const auto tip = [&] {
    const Twist twist = world.state(rod).twist;
    const Vector3 v = twist.v_WB + twist.w_WB.cross(p_tip) - v_WF;
    return Eigen::Vector2d(v.x(), v.z());
  };
  const auto energy = [&] {
    const Twist twist = world.state(rod).twist;
    return (mass * (twist.v_WB - v_WF).squaredNorm() + turning * twist.w_WB.squaredNorm()) / 2;
  };
  result.before = tip();
  result.energy_before = energy();
  const AdvanceReport report = world.advance(0.002);
  EXPECT_EQ(report.impacts.size(), 1u);
  result.after = tip();
  result.energy_after = energy();
  return result;
}

// The bounce that keeps the energy: with the tip stuck, after . inertia . after = before . inertia
// . before.
Scalar kept_bounce(const KaneRod& rod) {
  return std::sqrt(rod.before.dot(rod.inertia * rod.before) / rod.inertia(1, 1));
}

TEST(Impact, NeverGivesARodEnergyThroughFriction) {
  int reduced = 0;
  for (const Scalar lean : {-0.9, -0.5, 0.5, 0.9}) {
    for (const Scalar sliding : {-0.3, -0.1, 0.1, 0.3}) {
      for (const Scalar restitution : {0.5, 0.9, 1.0}) {
        for (const Scalar belt_speed : {0.0, 2.0, -50.0}) {
          const KaneRod rod = strike(lean, sliding, restitution, belt_speed);
          const Scalar kept = kept_bounce(rod);
          reduced += kept < restitution ? 1 : 0;
          EXPECT_LE(rod.energy_after, rod.energy_before * (1 + 1e-8));
          EXPECT_NEAR(rod.after[0], 0, 5e-3) << "it sticks";
          EXPECT_NEAR(rod.after[1], std::min(restitution, kept), 5e-3)
              << "lean " << lean << ", sliding " << sliding << ", restitution " << restitution
              << ", belt " << belt_speed;
        }
      }
    }
  }
  EXPECT_GE(reduced, 12);
}

}  // namespace
}  // namespace dyop
