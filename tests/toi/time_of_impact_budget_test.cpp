// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <memory>

#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::at;
using testing::moving;
using testing::point_mesh;
using testing::segment_mesh;

TEST(TimeOfImpact, StopsAtTheBudgetWithATimeThatIsSafe) {
  const TriangleMesh rod = segment_mesh({0, 0, 0}, {2, 0, 0});
  const auto turning = moving(RigidPose(), Vector3::Zero(), {0, 0, 1});
  const RestMotion obstacle(at(std::cos(3.0), std::sin(3.0), 0));
  ToiOptions options{.distance_tolerance = 1e-6};
  Scalar last = 0;
  bool has_finished = false;
  for (int budget = 1; budget < 200 && !has_finished; ++budget) {
    options.max_node_pairs = budget;
    const ToiResult result =
        time_of_impact(rod, turning, point_mesh(Vector3::Zero()), obstacle, {0, 10}, options);
    EXPECT_LE(result.statistics.node_pairs, budget);
    EXPECT_GE(result.t_safe, last);  // more work never proves less
    EXPECT_LT(result.t_safe, 3);
    has_finished = result.status == ToiStatus::Impact;
    EXPECT_TRUE(has_finished || result.status == ToiStatus::BudgetExhausted);
    last = result.t_safe;
  }
  EXPECT_TRUE(has_finished);
}

// A shaft that turns in its bearing: no step is longer than about the root of 8 gaps, but none need
// be shorter by an order of magnitude.
TEST(TimeOfImpact, TurnsAShaftBesideAWallInStepsOfTheRootOfTheGap) {
  const Box wall(Vector3(1, 1, 1));
  const Scalar turn = 20;
  const auto spinning = moving(RigidPose(), Vector3::Zero(), {0, 0, turn});
  const std::array<std::shared_ptr<const ConvexShape>, 2> shafts{std::make_shared<Cylinder>(1, 1),
                                                                 std::make_shared<Capsule>(1, 1)};
  for (const auto& shaft : shafts) {
    for (const Scalar gap : {1e-3, 1e-4, 1e-5}) {
      const RestMotion rest(at(2 + gap, 0, 0));
      const ToiResult result =
          time_of_impact(*shaft, spinning, wall, rest, {0, 1}, {.distance_tolerance = 1e-7});
      EXPECT_EQ(result.status, ToiStatus::Separated);
      EXPECT_LT(Scalar(result.statistics.node_pairs), 4 * turn / std::sqrt(8 * gap));
    }
  }
}

TEST(TimeOfImpact, HonoursDeadlineAndCancellation) {
  const Sphere sphere(1);
  const RestMotion rest{RigidPose()};
  const auto coming = moving(at(9, 0, 0), {-1, 0, 0}, {0, 0, 0});
  ToiOptions late;
  late.deadline = std::chrono::steady_clock::now();
  EXPECT_EQ(time_of_impact(sphere, rest, sphere, coming, {0, 10}, late).status,
            ToiStatus::BudgetExhausted);
  std::stop_source source;
  ToiOptions stopped;
  stopped.distance_tolerance = 1e-6;
  stopped.stop = source.get_token();
  EXPECT_EQ(time_of_impact(sphere, rest, sphere, coming, {0, 10}, stopped).status,
            ToiStatus::Impact);
  source.request_stop();
  const ToiResult result = time_of_impact(sphere, rest, sphere, coming, {0, 10}, stopped);
  EXPECT_EQ(result.status, ToiStatus::Cancelled);
  // Balls about the origins prove this much before anything is examined; the gap is 7 - t.
  EXPECT_LE(result.t_safe, 7);
  EXPECT_GT(result.t_safe, 7 - stopped.distance_tolerance.value());
}

// All pairs of two plates are equally near at the start: the search for a nearer one, which would
// examine all of them, ends at the deadline.
TEST(TimeOfImpact, SearchForANearerPairEndsAtItsDeadline) {
  const TriangleMesh plate = testing::plate_grid(100, 100, 100, 100).mesh();
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-3;
  const ConstantTwistMotion falling =
      moving(at(0.2, 0.3, 5.5e-4), Vector3(0, 0, -1), Vector3::Zero());
  const auto ask = [&](ToiWorkspace& workspace) {
    return time_of_impact(plate, RestMotion(), plate, falling, {0, 1}, options, workspace);
  };
  ToiWorkspace workspace;
  const ToiResult whole = ask(workspace);
  ASSERT_EQ(whole.status, ToiStatus::Impact);
  ASSERT_EQ(whole.t_safe, 0);
  EXPECT_GT(whole.statistics.node_pairs, 10'000) << "it has not examined all pairs";
  options.deadline = std::chrono::steady_clock::now() + std::chrono::microseconds(300);
  const ToiResult hurried = ask(workspace);
  ASSERT_EQ(hurried.status, ToiStatus::BudgetExhausted);
  EXPECT_EQ(hurried.t_safe, 0);
  options.deadline.reset();
  const ToiResult resumed =
      resume_time_of_impact(plate, RestMotion(), plate, falling, {0, 1}, options, workspace);
  EXPECT_EQ(resumed.status, ToiStatus::Impact);
}

TEST(TimeOfImpact, OfConvexShapesIsTheSameWhenResumedOneNodePairAtATime) {
  const Box box(Vector3(0.5, 0.4, 0.3));
  const ConstantTwistMotion X_WA = moving(at(0, 0, 0), {0, 0, 0}, {1, -2, 1});
  const ConstantTwistMotion X_WB = moving(at(2, 0.3, 0.1), {-2, 0, 0}, {-2, 1, 2});
  ToiOptions options;
  const ToiResult whole = time_of_impact(box, X_WA, box, X_WB, {0, 1}, options);
  ASSERT_EQ(whole.status, ToiStatus::Impact);
  ASSERT_GT(whole.statistics.leaf_tests, 2);
  options.max_node_pairs = 1;
  ToiWorkspace workspace;
  ToiResult part = time_of_impact(box, X_WA, box, X_WB, {0, 1}, options, workspace);
  for (int k = 0; k < 100 && part.status == ToiStatus::BudgetExhausted; ++k) {
    part = resume_time_of_impact(box, X_WA, box, X_WB, {0, 1}, options, workspace);
  }
  EXPECT_EQ(part.status, ToiStatus::Impact);
  EXPECT_EQ(part.t_safe, whole.t_safe);
  EXPECT_EQ(part.t_hit, whole.t_hit);
  EXPECT_EQ(part.contact->p_WCa, whole.contact->p_WCa);
}

}  // namespace
}  // namespace dyop
