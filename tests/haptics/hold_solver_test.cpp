// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/hold_solver.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/geometry/primitives.h"
#include "support/inputs/haptic_scenes.h"
#include "support/inputs/random_inputs.h"

namespace dyop::haptics_internal {
namespace {

using testing::random_direction;
using testing::random_number;
using testing::random_vector;

constexpr Scalar kExact = 1e-9;   // literal: tolerance of the solves
constexpr Scalar kOracle = 1e-6;  // literal: error of differences, for forces of size 100

// A frame and two jaws, held by one rigid obstacle.
struct HeldTool {
  std::vector<ToolHinge> hinges = std::vector<ToolHinge>(2);
  std::vector<ToolBody> bodies = std::vector<ToolBody>(3);
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  CouplingOptions coupling;
  StepGoal goal;
  std::vector<HoldPoint> holds;
  ToolStep step;

  explicit HeldTool(std::mt19937_64& random) {
    for (ToolHinge& hinge : hinges) {
      hinge = {testing::random_pose(2, random), 0, random_number(10, 100, random)};
    }
    bodies[1].hinge = 0;
    bodies[2].hinge = 1;
    ToolObstacle ball;
    ball.shape = std::make_shared<Sphere>(1);
    obstacles.push_back(make_rigid_obstacle(ball));
    coupling.stiffness = Vector3(20, 30, 40);
    coupling.rotational_stiffness = Vector3(50, 60, 70);
    goal = {{testing::random_pose(3, random), {0.3, -0.2}},
            {random_vector(1, random), random_vector(0.3, random), {0.1, -0.3}},
            1,
            0.1,
            1,
            kExact};
  }

  // Returns its work.
  std::int64_t solve() {
    HoldSolver solver(coupling, hinges, bodies, {}, holds.size());
    WorkClock clock;
    clock.start(WorkClock::Deadline());
    step = solver.solve(goal, obstacles, holds, clock);
    return clock.work();
  }

  // How a point of a body moves with a step, to first order: a difference quotient.
  Vector3 velocity(const HoldPoint& hold, const ToolStep& along) const {
    constexpr Scalar kShort = 1e-6;  // literal: step of the difference
    const ToolBody& body = bodies[hold.body];
    const auto place = [&](Scalar part) {
      const ToolPose pose = ToolMotion(goal.from, scaled(along, part), 1, hinges).at(1);
      return pose.X_WT * body_in_tool(body, hinges, pose);
    };
    const Vector3 p_B = place(0).inverse() * hold.p_WB;
    return (place(kShort) * p_B - place(-kShort) * p_B) / (2 * kShort);
  }

  // The force of the springs along a step, minus that of the holds.
  Scalar unbalanced(const ToolStep& along) const {
    Scalar sum =
        (step.v_W - goal.wish.v_W).dot(coupling.stiffness.cwiseProduct(along.v_W)) +
        (step.w_W - goal.wish.w_W).dot(coupling.rotational_stiffness.cwiseProduct(along.w_W));
    for (std::size_t k = 0; k < hinges.size(); ++k) {
      sum += (step.angles[k] - goal.wish.angles[k]) * hinges[k].stiffness * along.angles[k];
    }
    for (const HoldPoint& hold : holds) sum -= hold.impulse_W.dot(velocity(hold, along));
    return sum;
  }
};

HoldPoint random_hold(std::mt19937_64& random) {
  HoldPoint hold;
  hold.body = std::size_t(testing::random_index(3, random));
  hold.nhat_AB_W = random_direction(random);
  hold.p_WB = random_vector(4, random);
  hold.p_WA = hold.p_WB - random_number(0.1, 0.3, random) * hold.nhat_AB_W;
  hold.v_WA = random_vector(0.2, random);
  return hold;
}

void expect_law(const HeldTool& tool, const HoldPoint& hold, Scalar friction) {
  const Vector3& n = hold.nhat_AB_W;
  const Vector3 u = tool.velocity(hold, tool.step) - tool.goal.duration * hold.v_WA;
  const Scalar gap = hold.gap() + n.dot(u) - tool.goal.rest_gap;
  const Scalar pressure = n.dot(hold.impulse_W);
  const Vector3 u_t = u - n * n.dot(u), f_t = hold.impulse_W - n * pressure;
  EXPECT_GE(gap, -kOracle);
  EXPECT_GE(pressure, -kOracle);
  EXPECT_LE(std::min(gap, pressure), kOracle);
  EXPECT_LE(f_t.norm(), friction * pressure + kOracle);
  EXPECT_NEAR(f_t.dot(u_t), -friction * pressure * u_t.norm(), kOracle * (1 + pressure));
}

TEST(HoldSolver, ObeysTheLawsOfHingesGapsAndFriction) {
  std::mt19937_64 random(11);
  int pressed = 0;
  for (int i = 0; i < 200; ++i) {
    HeldTool tool(random);
    tool.obstacles[0]->friction = i % 4 == 0 ? 0 : 0.3;
    for (int k = i % 5; k >= 0; --k) tool.holds.push_back(random_hold(random));
    tool.solve();
    for (const HoldPoint& hold : tool.holds) {
      expect_law(tool, hold, tool.obstacles[0]->friction);
      pressed += !hold.impulse_W.isZero(0);
    }
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(tool.unbalanced({Vector3::Unit(k), Vector3::Zero(), {}}), 0, kOracle);
      EXPECT_NEAR(tool.unbalanced({Vector3::Zero(), Vector3::Unit(k), {}}), 0, kOracle);
    }
    EXPECT_NEAR(tool.unbalanced({Vector3::Zero(), Vector3::Zero(), {1, 0}}), 0, kOracle);
    EXPECT_NEAR(tool.unbalanced({Vector3::Zero(), Vector3::Zero(), {0, 1}}), 0, kOracle);
  }
  EXPECT_GT(pressed, 100);
}

// Two walls, nearer to the tool than they should be, move on together: both gaps cannot grow, but
// neither needs to shrink.
TEST(HoldSolver, KeepsGapsThatCannotGrowWhileTissueMoves) {
  std::mt19937_64 random(12);
  HeldTool tool(random);
  tool.goal.wish = {};
  tool.hinges.clear();
  tool.bodies.resize(1);
  for (const Scalar side : {1.0, -1.0}) {
    HoldPoint hold;
    hold.nhat_AB_W = side * Vector3::UnitX();
    hold.p_WB = tool.goal.from.X_WT.translation();
    hold.p_WA = hold.p_WB - 0.05 * hold.nhat_AB_W;
    hold.v_WA = Vector3(0.4, 0, 0);
    tool.holds.push_back(hold);
  }
  tool.solve();
  EXPECT_NEAR(tool.step.v_W.x(), 0.4, kOracle);
}

// Between two walls that close at nearly the angle of friction many solves are not given the time
// to come to their end. Whatever they leave, gaps are kept.
TEST(HoldSolver, KeepsGapsWhereItHasNoTimeToSolve) {
  std::mt19937_64 random(13);
  int unsolved = 0;
  for (int i = 0; i < 100; ++i) {
    HeldTool tool(random);
    tool.obstacles[0]->friction = 0.3;
    tool.goal.wish.v_W = Vector3(0, 0, random_number(-1, 1, random));
    for (int k = 0; k < 20; ++k) {
      HoldPoint hold = random_hold(random);
      const Scalar side = k % 2 == 0 ? 1 : -1;
      hold.nhat_AB_W = Vector3(side, random_number(-0.1, 0.1, random), 0.28).normalized();
      hold.p_WA = hold.p_WB - tool.goal.rest_gap * hold.nhat_AB_W;
      hold.v_WA = 0.02 * hold.nhat_AB_W;
      tool.holds.push_back(hold);
    }
    const std::int64_t work = tool.solve();
    EXPECT_LT(work, 3000) << i;
    Scalar least = kInfinity;
    for (const HoldPoint& hold : tool.holds) {
      const Vector3 u = tool.velocity(hold, tool.step) - hold.v_WA;
      least = std::min(least, hold.nhat_AB_W.dot(u));
    }
    EXPECT_GE(least, -kOracle) << i;
    unsolved += std::abs(tool.unbalanced({Vector3::UnitZ(), Vector3::Zero(), {}})) > kOracle;
  }
  EXPECT_GT(unsolved, 10);
}

}  // namespace
}  // namespace dyop::haptics_internal
