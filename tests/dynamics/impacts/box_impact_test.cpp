// SPDX-License-Identifier: BSD-3-Clause

// Boxes that strike a floor flat, on an edge and on a corner, and bodies some of whose axes are
// locked, against Newton's law of restitution.
#include <gtest/gtest.h>

#include <cmath>

#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

const Vector3 kCoarseHalf(0.3, 0.2, 0.1);

struct BoxImpact {
  Scalar met = 0;                     // speed at which the lowest point met the floor
  Vector3 p_WCm = Vector3::Zero();    // of that point from the centre of mass, at the impact
  Vector3 v_after = Vector3::Zero();  // of the centre, right after it
  Vector3 w_after = Vector3::Zero();
  BodyDefinition body;
};

// A box without friction falls from a little above a floor.
BoxImpact drop(const Matrix3& R, Scalar restitution, const LockedAxes& locked = {}) {
  constexpr Scalar kSpeed = 2;
  World world(earth_options());
  world.add_body(floor_body(0, 1));
  BoxImpact result;
  result.body =
      dynamic_body("box", std::make_shared<Box>(kCoarseHalf), {0, 0, 0}, {0.3, 0.1, -kSpeed});
  const Scalar lowest = -(R.row(2).transpose().cwiseAbs()).dot(kCoarseHalf);
  result.body.initial.X_WB = RigidPose(R, Vector3(0, 0, 0.02 - lowest));
  result.body.restitution = restitution;
  result.body.friction = 0;
  result.body.locked = locked;
  if (locked.translation[0]) result.body.initial.twist.v_WB.head<2>().setZero();
  const BodyId id = world.add_body(result.body);
  AdvanceReport report;
  while (report.impacts.empty() && world.time() < 0.05) report = world.advance(0.001);
  EXPECT_EQ(report.impacts.size(), 1u);
  if (report.impacts.size() != 1) return result;
  const ImpactEvent& event = report.impacts[0];
  result.met = -event.contacts.at(0).normal_velocity;
  const MotionState state = world.state(id);
  const Scalar late = world.time() - event.t;
  result.v_after = state.twist.v_WB + Vector3(0, 0, kGravity * late);
  result.w_after = state.twist.w_WB;
  const Vector3 center = state.X_WB.translation() - late * result.v_after;
  result.p_WCm = event.contacts[0].contact.p_WCb - center;
  return result;
}

TEST(BoxImpact, ABoxThatFallsFlatBouncesFlat) {
  for (const Scalar restitution : {0.3, 0.8, 1.0}) {
    const BoxImpact box = drop(rotation_from_vector(Vector3(0, 0, 0.3)), restitution);
    EXPECT_NEAR(box.v_after.z(), restitution * box.met, 1e-6 * box.met);
    EXPECT_NEAR(box.v_after.x(), 0.3, 1e-6);
    EXPECT_LT(box.w_after.norm(), 1e-6);
  }
}

TEST(BoxImpact, ABoxThatFallsOnACornerOrAnEdgeTurnsAsItsLeverSays) {
  for (const Vector3& lean : {Vector3(0.5, -0.3, 0.2), Vector3(-0.2, 0.9, 0), Vector3(0, 0.4, 0)}) {
    const Matrix3 R = rotation_from_vector(lean);
    for (const Scalar restitution : {0.2, 0.6, 1.0}) {
      const BoxImpact box = drop(R, restitution);
      const Matrix3 inverse = R * box.body.mass_properties.I_BBcm.inverse() * R.transpose();
      const Scalar mass = box.body.mass_properties.mass;
      Vector3 lever = box.p_WCm;
      if (lean.x() == 0) lever.y() = 0;  // both ends of the edge share the impulse
      const Vector3 turn = lever.cross(Vector3::UnitZ());
      const Scalar impulse = (1 + restitution) * box.met / (1 / mass + turn.dot(inverse * turn));
      EXPECT_NEAR(box.v_after.z(), impulse / mass - box.met, 2e-3 * box.met);
      const Vector3 w = inverse * turn * impulse;
      EXPECT_LT((box.w_after - w).norm(), 1e-2 * w.norm()) << lean.transpose();
      // The corner itself obeys Newton's law.
      EXPECT_NEAR(box.v_after.z() + box.w_after.cross(lever).z(), restitution * box.met,
                  1e-2 * box.met);
    }
  }
}

TEST(BoxImpact, ABoxThatMustNotTurnBouncesOnACornerAsIfFlat) {
  LockedAxes locked;
  locked.rotation = {true, true, true};
  const BoxImpact box = drop(rotation_from_vector(Vector3(0.5, -0.3, 0.2)), 0.7, locked);
  EXPECT_NEAR(box.v_after.z(), 0.7 * box.met, 1e-6 * box.met);
  EXPECT_EQ(box.w_after.norm(), 0);
}

// An elastic ball strikes a plate that can only turn, about its middle: J = 2 v / (1/m + r^2 / I).
TEST(BoxImpact, ABodyThatCanOnlyTurnIsStruckAtItsLever) {
  constexpr Scalar kSpeed = 3;
  constexpr Scalar kLever = 0.7;
  World world;
  BodyDefinition plate =
      dynamic_body("plate", std::make_shared<Box>(Vector3(1, 0.3, 0.05)), {0, 0, 0});
  plate.locked.translation = {true, true, true};
  plate.restitution = 1;
  plate.friction = 0;
  BodyDefinition ball =
      dynamic_body("ball", std::make_shared<Sphere>(0.1), {kLever, 0, 0.2}, {0, 0, -kSpeed});
  ball.restitution = 1;
  ball.friction = 0;
  const BodyId turned = world.add_body(plate);
  const BodyId thrown = world.add_body(ball);
  for (int k = 0; k < 3; ++k) ASSERT_EQ(world.advance(0.01).status, AdvanceStatus::Completed);
  const Scalar inertia = plate.mass_properties.I_BBcm(1, 1);
  const Scalar mass = ball.mass_properties.mass;
  const Scalar impulse = 2 * kSpeed / (1 / mass + kLever * kLever / inertia);
  EXPECT_NEAR(world.state(thrown).twist.v_WB.z(), impulse / mass - kSpeed, 1e-9);
  EXPECT_NEAR(world.state(turned).twist.w_WB.y(), kLever * impulse / inertia, 1e-9);
  EXPECT_EQ(world.state(turned).X_WB.translation().norm(), 0);
}

}  // namespace
}  // namespace dyop
