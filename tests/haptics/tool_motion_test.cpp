// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "dyop/motion/check_motion.h"
#include "haptics/tool_body.h"
#include "motion/guarded_state.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::haptics_internal {
namespace {

using testing::random_number;
using testing::random_vector;

TEST(HingeMotion, KeepsThePromisesOfAMotion) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const ConstantTwistMotion X_WT(testing::random_pose(2, random),
                                   testing::random_twist(3, 4, random));
    const HingeMotion motion(X_WT, testing::random_pose(1, random), random_number(-2, 2, random),
                             random_number(-5, 5, random));
    const MotionCheck check = check_motion(motion, {0, 1});
    EXPECT_TRUE(check.is_sound()) << check.message;
  }
}

// A pose that is off by rounding as much as a motion lets it be: not restored, nor refused.
RigidPose rough_pose(std::mt19937_64& random) {
  const Scalar most = kRestoredFraction * kEngineRotationNoise;
  for (;;) {
    RigidPose X = testing::random_pose(1, random);
    for (int k = 0; k < 10; ++k) {
      X = RigidPose::from_trusted(X.rotation() * testing::random_pose(1, random).rotation(),
                                  X.translation());
    }
    const Scalar error = rotation_error(X.rotation());
    if (error > 0.7 * most && error <= most) return X;
  }
}

TEST(HingeMotion, StaysARotationWhenErrorsOfItsFactorsAddUp) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20000; ++i) {
    const ConstantTwistMotion X_WT(rough_pose(random), testing::random_twist(3, 4, random));
    const HingeMotion motion(X_WT, rough_pose(random), random_number(-2, 2, random),
                             random_number(-5, 5, random));
    EXPECT_TRUE(is_rotation(motion.pose(0.1).rotation())) << i;
  }
}

ToolBody box_body(std::optional<std::size_t> hinge) {
  HapticScene scene;
  const auto box = std::make_shared<TriangleMesh>(
      testing::box_mesh({0.5, 0.2, 1}).moved(Matrix3::Identity(), {0.3, 0.4, 0.1}).mesh());
  scene.tool.push_back({box, RigidPose(), hinge});
  if (hinge) scene.hinges.resize(1);
  return make_tool_bodies(scene.tools().front(), 0, true).front();
}

TEST(ToolMotion, BoundsTheDisplacementOfEveryPoint) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 400; ++i) {
    std::vector<ToolHinge> hinges(1);
    hinges[0].X_TJ = testing::random_pose(1, random);
    const ToolBody body = box_body(i % 2 == 0 ? std::nullopt : std::optional<std::size_t>(0));
    ToolPose from{testing::random_pose(3, random), {random_number(-1, 1, random)}};
    const ToolStep step{
        random_vector(1, random), random_vector(1, random), {random_number(-1, 1, random)}};
    const ToolMotion motion(from, step, 2, hinges);
    const Scalar t = random_number(0, 2, random);
    const Scalar bound = motion.largest_displacement(body, t);
    const RigidPose X0 = motion.of(body).pose(0);
    const auto [shift_W, rest] = motion.shift(body, t);
    const RigidPose X_end = motion.of(body).pose(t);
    for (const Vector3& p : body.pieces[0].mesh.vertices()) {
      EXPECT_LE((X_end * p - X0 * p - shift_W).norm(), rest + 1e-12);  // literal: rounding
    }
    Scalar largest = 0;
    for (int k = 0; k <= 10; ++k) {
      const RigidPose X1 = motion.of(body).pose(t * k / 10);
      for (const Vector3& p : body.pieces[0].mesh.vertices()) {
        largest = std::max(largest, (X1 * p - X0 * p).norm());
      }
    }
    EXPECT_LE(largest, bound * (1 + 1e-12));
    if (!body.hinge && step.w_W.norm() < 0.5) {
      EXPECT_GT(largest, bound * t / 8);
    }
  }
}

TEST(ToolMotion, EndsWhereTheStepBetweenTwoPosesLeads) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 100; ++i) {
    const ToolPose from{testing::random_pose(3, random), {0.2}};
    const ToolPose to{testing::random_pose(3, random), {-0.4}};
    const ToolMotion motion(from, step_between(from, to), 1e-3, {});
    const ToolPose end = motion.at(1e-3);
    EXPECT_TRUE(end.X_WT.translation().isApprox(to.X_WT.translation(), 1e-12));
    EXPECT_TRUE(end.X_WT.rotation().isApprox(to.X_WT.rotation(), 1e-9));
    EXPECT_NEAR(end.angles[0], -0.4, 1e-12);
  }
}

}  // namespace
}  // namespace dyop::haptics_internal
