// SPDX-License-Identifier: BSD-3-Clause

// Bodies on ball joints that turn fast about their own axes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "support/inputs/world_scenes.h"
#include "support/run_world.h"
#include "support/world_energy.h"

namespace dyop {
namespace {

using namespace testing;

Scalar axial_spin(const World& world, BodyId id) {
  const MotionState state = world.state(id);
  return state.twist.w_WB.dot(state.X_WB.rotation().col(2));
}

// It precesses at the slower root of (I1 + m l^2) cos(tilt) W^2 - I3 w3 W + m g l = 0. It turns by up
// to two radians a step.
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
      EXPECT_NEAR(std::atan2(p.y(), p.x()), rate, 30 * h * h * rate) << h << ' ' << spin;
      EXPECT_NEAR(std::acos(p.z() / p.norm()), kTilt, 40 * h * h) << h << ' ' << spin;
      EXPECT_NEAR(axial_spin(world, id), spin, 1e-5 * spin) << h << ' ' << spin;
    }
  }
}

// A rod on a ball joint at its end, and rods that hang on it by ball joints, turning as one. All
// impulses act on their axes, so none turns a rod about its own.
class SpinningRods {
 public:
  SpinningRods(int count, const Vector3& along, const Vector3& w_W, const Vector3& gravity_W,
               const Vector3& offset = Vector3::Zero()) {
    WorldOptions options;
    options.gravity_W = gravity_W;
    world.emplace(options);
    BodyDefinition post = floor_body(0);
    post.shape = std::make_shared<Sphere>(0.01);
    post.initial.X_WB = RigidPose(offset);
    post.filter = {1, 0};
    const Matrix3 R =
        Quaternion::FromTwoVectors(Vector3::UnitZ(), along).normalized().toRotationMatrix();
    JointDefinition joint;
    joint.kind = JointKind::Ball;
    joint.a = world->add_body(post);
    joint.X_BJ = RigidPose(Vector3(0, 0, -kHalf));
    for (int i = 0; i < count; ++i) {
      const Vector3 p = (2 * i + 1) * kHalf * along;
      BodyDefinition rod =
          dynamic_body("rod", std::make_shared<Box>(Vector3(0.02, 0.02, kHalf)), Vector3::Zero());
      rod.initial = {RigidPose(R, offset + p), Twist{w_W.cross(p), w_W}};
      rod.filter = {1, 0};
      joint.b = rods.emplace_back(world->add_body(rod));
      joint.name = std::to_string(i);
      world->add_joint(joint);
      joint.a = joint.b;
      joint.X_AJ = RigidPose(Vector3(0, 0, kHalf));
    }
  }

  static constexpr Scalar kHalf = 0.15;
  std::optional<World> world;
  std::vector<BodyId> rods;
};

// One without gravity precesses about its angular momentum L about the joint at the rate |L| / I1.
TEST(SpinningTop, ARodOnABallJointPrecessesWithoutTorque) {
  for (const Vector3& offset : {Vector3(0, 0, 0), Vector3(50, -20, 30)}) {
    std::vector<Scalar> errors;
    for (const Scalar h : {0.002, 0.001}) {
      const Vector3 along = Vector3(1, 2, -2) / 3;
      const Vector3 w_W = 80 * along + 30 * along.unitOrthogonal();
      SpinningRods one(1, along, w_W, Vector3::Zero(), offset);
      const MassProperties& m = one.world->body(one.rods[0]).mass_properties;
      const Scalar across = m.I_BBcm(0, 0) + m.mass * SpinningRods::kHalf * SpinningRods::kHalf;
      const Vector3 L_W = across * 30 * along.unitOrthogonal() + m.I_BBcm(2, 2) * 80 * along;
      constexpr Scalar kTime = 0.5;
      const Scalar energy = one.world->kinetic_energy();
      run_solved(*one.world, kTime, h);
      const Vector3 expected = rotation_from_vector(kTime / across * L_W) * along;
      const Matrix3 R = one.world->state(one.rods[0]).X_WB.rotation();
      errors.push_back((R.col(2) - expected).norm());
      EXPECT_NEAR(one.world->kinetic_energy(), energy, 1e-4 * energy) << h;
      EXPECT_NEAR(axial_spin(*one.world, one.rods[0]), 80, 1e-4 * 80) << h;
    }
    EXPECT_LT(errors[0], 0.02);
    EXPECT_LT(errors[1], 0.3 * errors[0]);
  }
}

// They turn by up to a radian a step.
TEST(SpinningTop, RodsInAChainKeepTheirSpinAndEnergy) {
  for (const int count : {1, 3}) {
    for (const Scalar h : {0.01, 0.005}) {
      for (const unsigned seed : {1U, 2U}) {
        std::mt19937 random(seed);
        std::normal_distribution<Scalar> normal;
        const auto draw = [&] { return Vector3(normal(random), normal(random), normal(random)); };
        const Vector3 along = draw().normalized();
        const Vector3 w_W = 100 * draw().normalized();
        const Vector3 gravity_W(0, 0, -kGravity);
        SpinningRods chain(count, along, w_W, gravity_W);
        const Scalar begin = testing::energy(*chain.world, gravity_W);
        Scalar most = begin;
        for (int k = 0; k < 100; ++k) {
          const AdvanceReport report = chain.world->advance(h);
          ASSERT_EQ(report.status, AdvanceStatus::Completed);
          ASSERT_EQ(report.work.stalls, 0);
          most = std::max(most, testing::energy(*chain.world, gravity_W));
        }
        SCOPED_TRACE(::testing::Message() << count << ' ' << h << ' ' << seed);
        EXPECT_LT(most - begin, 1e-3 * begin);
        for (const BodyId rod : chain.rods) {
          EXPECT_NEAR(axial_spin(*chain.world, rod), w_W.dot(along), 2);
        }
      }
    }
  }
}

}  // namespace
}  // namespace dyop
