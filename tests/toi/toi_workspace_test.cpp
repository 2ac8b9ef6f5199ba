// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/allocation_count.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using testing::gear;
using testing::message_of;
using testing::torus;

const TimeInterval kInterval{0, 2};

ConstantTwistMotion random_approach(std::mt19937_64& random) {
  const Vector3 p = 3 * testing::random_direction(random);
  const Vector3 v = (testing::random_vector(0.5, random) - p).normalized() * 1.5;
  const RigidPose X(rotation_from_vector(testing::random_vector(2, random)), p);
  return ConstantTwistMotion(X, {v, testing::random_vector(3, random)});
}

ConstantTwistMotion turning(std::mt19937_64& random) {
  return ConstantTwistMotion(RigidPose(), {Vector3::Zero(), testing::random_vector(3, random)});
}

void expect_same_answer(const ToiResult& x, const ToiResult& y) {
  EXPECT_TRUE(testing::has_same_bits(x, y)) << x.t_safe << " " << y.t_safe;
}

TEST(ToiWorkspace, ChangesNoResult) {
  const TriangleMesh a = gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh b = torus(0.8, 0.3, 24, 12).mesh();
  std::mt19937_64 random(1);
  ToiWorkspace workspace;
  for (int k = 0; k < 50; ++k) {
    const ConstantTwistMotion X_WA = turning(random);
    const ConstantTwistMotion X_WB = random_approach(random);
    expect_same_answer(time_of_impact(a, X_WA, b, X_WB, kInterval, {}, workspace),
                       time_of_impact(a, X_WA, b, X_WB, kInterval));
    EXPECT_FALSE(workspace.can_resume());
  }
}

TEST(ToiWorkspace, SparesAllAllocationsOnceItHasGrown) {
  const TriangleMesh a = gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh b = torus(0.8, 0.3, 24, 12).mesh();
  ToiWorkspace workspace;
  const auto run = [&] {
    std::mt19937_64 random(2);
    std::int64_t allocations = 0;
    for (int k = 0; k < 40; ++k) {
      const ConstantTwistMotion X_WA = turning(random);
      const ConstantTwistMotion X_WB = random_approach(random);
      const std::int64_t before = testing::allocation_count();
      time_of_impact(a, X_WA, b, X_WB, kInterval, {}, workspace);
      allocations += testing::allocation_count() - before;
    }
    return allocations;
  };
  EXPECT_GT(run(), 0);  // the guard works
  EXPECT_EQ(run(), 0);
}

TEST(ToiWorkspace, GoesOnWhereABudgetRanOut) {
  const TriangleMesh a = gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh b = torus(0.8, 0.3, 24, 12).mesh();
  std::mt19937_64 random(3);
  ToiWorkspace workspace;
  ToiOptions small;
  int resumed = 0;
  for (int k = 0; k < 30; ++k) {
    const ConstantTwistMotion X_WA = turning(random);
    const ConstantTwistMotion X_WB = random_approach(random);
    small.max_node_pairs = 1 + k;
    ToiResult result = time_of_impact(a, X_WA, b, X_WB, kInterval, small, workspace);
    // Some thousand pieces at most: every call makes progress.
    for (int call = 0; call < 10000 && result.status == ToiStatus::BudgetExhausted; ++call) {
      ++resumed;
      ASSERT_TRUE(workspace.can_resume());
      const Scalar t_safe = result.t_safe;
      result = resume_time_of_impact(a, X_WA, b, X_WB, kInterval, small, workspace);
      ASSERT_GE(result.t_safe, t_safe);
    }
    expect_same_answer(result, time_of_impact(a, X_WA, b, X_WB, kInterval));
  }
  EXPECT_GT(resumed, 100);
}

// A query that starts in contact searches for a nearer pair before it reports.
TEST(ToiWorkspace, GoesOnWithALookForANearerPair) {
  const TriangleMesh a = gear(15, 0.8, 1, 0.2).mesh();
  const TriangleMesh b = torus(0.8, 0.3, 24, 12).mesh();
  std::mt19937_64 random(4);
  ToiWorkspace workspace;
  ToiOptions options;
  int looks = 0;
  for (int k = 0; k < 30; ++k) {
    const ConstantTwistMotion X_WA = turning(random);
    const ConstantTwistMotion X_WB = random_approach(random);
    const ToiResult approach = time_of_impact(a, X_WA, b, X_WB, kInterval);
    if (approach.status != ToiStatus::Impact) continue;
    const TimeInterval rest{approach.t_safe, kInterval.end};
    options.max_node_pairs = ToiOptions().max_node_pairs;
    const ToiResult whole = time_of_impact(a, X_WA, b, X_WB, rest, options);
    ASSERT_EQ(whole.status, ToiStatus::Impact);
    ASSERT_EQ(whole.t_safe, rest.begin);
    options.max_node_pairs = 1 + k;
    ToiResult result = time_of_impact(a, X_WA, b, X_WB, rest, options, workspace);
    std::int64_t node_pairs = result.statistics.node_pairs;
    for (int call = 0; call < 10000 && result.status == ToiStatus::BudgetExhausted; ++call) {
      ASSERT_EQ(result.statistics.node_pairs, options.max_node_pairs);
      ++looks;
      result = resume_time_of_impact(a, X_WA, b, X_WB, rest, options, workspace);
      node_pairs += result.statistics.node_pairs;
    }
    expect_same_answer(result, whole);
    EXPECT_EQ(node_pairs, whole.statistics.node_pairs);
    EXPECT_LE(result.statistics.node_pairs, options.max_node_pairs);
  }
  EXPECT_GT(looks, 100);
}

TEST(ToiWorkspace, TakesItsUnfinishedQueryAlongWhenMoved) {
  const TriangleMesh a = gear(15, 0.8, 1, 0.2).mesh();
  std::mt19937_64 random(5);
  const ConstantTwistMotion X_WA = turning(random);
  const ConstantTwistMotion X_WB = random_approach(random);
  ToiOptions small;
  small.max_node_pairs = 1;
  ToiWorkspace first;
  time_of_impact(a, X_WA, a, X_WB, kInterval, small, first);
  ToiWorkspace second = std::move(first);
  ASSERT_TRUE(second.can_resume());
  ToiWorkspace third;
  third = std::move(second);
  expect_same_answer(resume_time_of_impact(a, X_WA, a, X_WB, kInterval, {}, third),
                     time_of_impact(a, X_WA, a, X_WB, kInterval));
}

TEST(ToiWorkspace, ResumesOnlyTheQueryItHolds) {
  const Box box(Vector3(1, 1, 1));
  const ConstantTwistMotion X_WA(RigidPose(), {});
  const ConstantTwistMotion X_WB(RigidPose(Vector3(5, 0, 0)),
                                 {Vector3(-1, 0, 0), Vector3(0, 1, 0)});
  ToiWorkspace workspace;
  EXPECT_THROW(resume_time_of_impact(box, X_WA, box, X_WB, {0, 9}, {}, workspace), InvalidArgument);
  ToiOptions small;
  small.max_node_pairs = 1;
  ASSERT_EQ(time_of_impact(box, X_WA, box, X_WB, {0, 9}, small, workspace).status,
            ToiStatus::BudgetExhausted);
  EXPECT_THROW(resume_time_of_impact(box, X_WA, box, X_WB, {0, 8}, {}, workspace), InvalidArgument);
  EXPECT_THROW(resume_time_of_impact(box, X_WB, box, X_WA, {0, 9}, {}, workspace), InvalidArgument);
  EXPECT_EQ(resume_time_of_impact(box, X_WA, box, X_WB, {0, 9}, {}, workspace).status,
            ToiStatus::Impact);
}

// The inner query is asked in the middle of the outer one, as by a second thread.
TEST(ToiWorkspace, RefusesASecondQueryWhileItServesOne) {
  const TriangleMesh mesh = torus(0.8, 0.3, 12, 6).mesh();
  const Box box({1, 1, 1});
  const RestMotion at_rest{RigidPose()};
  const ConstantTwistMotion approach(RigidPose(Vector3(5, 0, 0)),
                                     {-Vector3::UnitX(), Vector3::Zero()});
  ToiWorkspace workspace;
  std::string message;
  UserMotion::Functions functions;
  functions.pose = [&](Scalar t) {
    if (message.empty()) {
      message = message_of(
          [&] { time_of_impact(box, at_rest, mesh, approach, kInterval, {}, workspace); });
    }
    return approach.pose(t);
  };
  functions.twist = [&](Scalar t) { return approach.twist(t); };
  functions.twist_bound = [&](const TimeInterval& part) { return approach.twist_bound(part); };
  const UserMotion nosy(functions);
  const ToiResult result = time_of_impact(mesh, at_rest, mesh, nosy, kInterval, {}, workspace);
  EXPECT_EQ(message,
            "time_of_impact: the workspace is in use by another query; give each thread its own");
  expect_same_answer(result, time_of_impact(mesh, at_rest, mesh, approach, kInterval));
  EXPECT_EQ(
      message_of([&] { time_of_impact(box, at_rest, mesh, approach, kInterval, {}, workspace); }),
      "no error");
}

TEST(ToiWorkspace, SharedByThreadsThrowsAndNeverMixesAnswers) {
  const TriangleMesh mesh = torus(0.8, 0.3, 24, 12).mesh();
  const RestMotion at_rest{RigidPose()};
  const ConstantTwistMotion approach(RigidPose(Vector3(3, 0.1, 0.2)),
                                     {-Vector3::UnitX(), Vector3(0, 1, 2)});
  const ToiResult expected = time_of_impact(mesh, at_rest, mesh, approach, kInterval);
  ToiWorkspace workspace;
  std::atomic<int> answered{0};
  std::atomic<int> wrong{0};
  const auto ask = [&] {
    for (int k = 0; k < 200; ++k) {
      try {
        const ToiResult result =
            time_of_impact(mesh, at_rest, mesh, approach, kInterval, {}, workspace);
        ++answered;
        if (!testing::has_same_bits(result, expected)) ++wrong;
      } catch (const InvalidArgument&) {
      }
    }
  };
  {
    const std::jthread one(ask);
    const std::jthread other(ask);
  }
  EXPECT_GT(answered, 0);
  EXPECT_EQ(wrong, 0);
}

TEST(ToiWorkspace, MovedFromIsAnErrorUntilAssigned) {
  const Box box({1, 1, 1});
  const RestMotion at_rest{RigidPose()};
  const ConstantTwistMotion approach(RigidPose(Vector3(5, 0, 0)),
                                     {-Vector3::UnitX(), Vector3::Zero()});
  ToiWorkspace first;
  ToiWorkspace second = std::move(first);
  const auto ask = [&](ToiWorkspace& workspace) {
    return message_of(
        [&] { time_of_impact(box, at_rest, box, approach, kInterval, {}, workspace); });
  };
  const std::string refusal = "this ToiWorkspace was moved from and is empty";
  EXPECT_EQ(ask(first), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(first.can_resume()); }), refusal);
  EXPECT_EQ(ask(second), "no error");
  first = ToiWorkspace();
  EXPECT_EQ(ask(first), "no error");
}

}  // namespace
}  // namespace dyop
