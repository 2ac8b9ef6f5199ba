// SPDX-License-Identifier: BSD-3-Clause

// A top on a fixed point precesses steadily at the slower root of
// (I1 + m l^2) cos(tilt) W^2 - I3 w3 W + m g l = 0.
#include <gtest/gtest.h>

#include <cmath>

#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

// It turns by up to two radians a step.
TEST(SpinningTop, PrecessesSteadily) {
  for (const Scalar h : {0.01, 0.0025}) {
    for (const Scalar spin : {100.0, 200.0}) {
      constexpr Scalar kTilt = 1;
      World world(earth_options());
      BodyDefinition anchor = floor_body(0);
      anchor.shape = std::make_shared<Sphere>(0.05);
      anchor.initial.X_WB = RigidPose();
      const BodyId support = world.add_body(anchor);
      BodyDefinition top =
          dynamic_body("top", std::make_shared<Box>(Vector3(0.4, 0.4, 0.05)), Vector3::Zero());
      const MassProperties& m = top.mass_properties;
      const Scalar across = m.I_BBcm(0, 0) + m.mass;  // about the fixed point, l = 1
      const Scalar drive = m.I_BBcm(2, 2) * spin;
      const Scalar rate =
          (drive - std::sqrt(drive * drive - 4 * across * std::cos(kTilt) * m.mass * kGravity)) /
          (2 * across * std::cos(kTilt));
      const Matrix3 R = rotation_from_vector(Vector3(0, kTilt, 0));
      const Vector3 axis = R.col(2);
      const Vector3 w = Vector3(0, 0, rate) + (spin - rate * std::cos(kTilt)) * axis;
      top.initial = {RigidPose(R, axis), Twist{w.cross(axis), w}};
      const BodyId id = world.add_body(top);
      JointDefinition joint;
      joint.name = "point";
      joint.kind = JointKind::Ball;
      joint.a = support;
      joint.b = id;
      joint.X_BJ = RigidPose(Vector3(0, 0, -1));
      world.add_joint(joint);
      for (int k = 0; k < std::lround(1 / h); ++k) {
        ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
      }
      const Vector3 p = world.state(id).X_WB.translation();
      EXPECT_NEAR(std::atan2(p.y(), p.x()), rate, 1e-3 * rate) << h << ' ' << spin;
      EXPECT_NEAR(std::acos(p.z() / p.norm()), kTilt, 2e-3) << h << ' ' << spin;
    }
  }
}

}  // namespace
}  // namespace dyop
