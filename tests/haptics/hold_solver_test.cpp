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

// Tools of a frame and two jaws each, held by one rigid obstacle and by each other.
struct HeldTools {
  std::vector<HapticTool> tools;
  std::vector<ToolBody> bodies;
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  StepGoal goal;
  std::vector<HoldPoint> holds;
  ToolSteps steps;

  explicit HeldTools(std::mt19937_64& random, std::size_t count = 1) : steps(count) {
    goal = {ToolPoses(count), ToolSteps(count), 1, 0.1, 1, kExact};
    for (std::size_t k = 0; k < count; ++k) {
      HapticTool& tool = tools.emplace_back();
      for (int i = 0; i < 2; ++i) {
        tool.hinges.push_back({testing::random_pose(2, random), 0, random_number(10, 100, random)});
      }
      tool.coupling.emplace();
      tool.coupling->stiffness = Vector3(20, 30, 40);
      tool.coupling->rotational_stiffness = Vector3(50, 60, 70);
      for (const std::optional<std::size_t> hinge : {std::optional<std::size_t>(), {0}, {1}}) {
        bodies.emplace_back().tool = k;
        bodies.back().hinge = hinge;
      }
      goal.from[k] = {testing::random_pose(3, random), {0.3, -0.2}};
      goal.wish[k] = {random_vector(1, random), random_vector(0.3, random), {0.1, -0.3}};
    }
    ToolObstacle ball;
    ball.shape = std::make_shared<Sphere>(1);
    obstacles.push_back(make_rigid_obstacle(ball));
  }

  // Returns its work.
  std::int64_t solve() {
    HoldSolver solver(tools, bodies, holds.size());
    WorkClock clock;
    clock.start(WorkClock::Deadline());
    steps = solver.solve(goal, obstacles, holds, clock);
    return clock.work();
  }

  // How a point of a body moves with a step, to first order: a difference quotient.
  Vector3 velocity(std::size_t number, const Vector3& p_W, const ToolStep& along) const {
    constexpr Scalar kShort = 1e-6;  // literal: step of the difference
    const ToolBody& body = bodies[number];
    const std::vector<ToolHinge>& hinges = tools[body.tool].hinges;
    const auto place = [&](Scalar part) {
      const ToolPose pose = ToolMotion(goal.from[body.tool], scaled(along, part), 1, hinges).at(1);
      return pose.X_WT * body_in_tool(body, hinges, pose);
    };
    const Vector3 p_B = place(0).inverse() * p_W;
    return (place(kShort) * p_B - place(-kShort) * p_B) / (2 * kShort);
  }

  // Of the body relative to the obstacle, if only one tool moves, or both with the steps found.
  Vector3 velocity(const HoldPoint& hold, std::size_t tool, const ToolStep& along) const {
    Vector3 u = Vector3::Zero();
    if (bodies[hold.body].tool == tool) u += velocity(hold.body, hold.p_WB, along);
    if (hold.other && bodies[*hold.other].tool == tool) {
      u -= velocity(*hold.other, hold.p_WA, along);
    }
    return u;
  }
  Vector3 velocity(const HoldPoint& hold) const {
    Vector3 u = Vector3::Zero();
    for (std::size_t k = 0; k < tools.size(); ++k) u += velocity(hold, k, steps[k]);
    return u;
  }

  // The force of a tool's springs along a step, minus that of the holds.
  Scalar unbalanced(const ToolStep& along, std::size_t tool = 0) const {
    const CouplingOptions& coupling = *tools[tool].coupling;
    const ToolStep& step = steps[tool];
    const ToolStep& wish = goal.wish[tool];
    Scalar sum = (step.v_W - wish.v_W).dot(coupling.stiffness.cwiseProduct(along.v_W)) +
                 (step.w_W - wish.w_W).dot(coupling.rotational_stiffness.cwiseProduct(along.w_W));
    for (std::size_t k = 0; k < tools[tool].hinges.size(); ++k) {
      sum += (step.angles[k] - wish.angles[k]) * tools[tool].hinges[k].stiffness * along.angles[k];
    }
    for (const HoldPoint& hold : holds) sum -= hold.impulse_W.dot(velocity(hold, tool, along));
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

void expect_law(const HeldTools& tool, const HoldPoint& hold, Scalar friction) {
  const Vector3& n = hold.nhat_AB_W;
  const Vector3 u = tool.velocity(hold) - tool.goal.duration * hold.v_WA;
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
    HeldTools tool(random);
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

// Two tools press on what is at rest and on each other, frames and jaws alike: the springs of each
// balance what holds it.
TEST(HoldSolver, ObeysTheLawsBetweenTools) {
  std::mt19937_64 random(14);
  int pressed = 0;
  for (int i = 0; i < 200; ++i) {
    HeldTools both(random, 2);
    both.obstacles[0]->friction = i % 4 == 0 ? 0 : 0.3;
    for (int k = i % 6; k >= 0; --k) {
      HoldPoint hold = random_hold(random);
      if (k % 2 == 0) {
        hold.other = hold.body;
        hold.body = 3 + std::size_t(testing::random_index(3, random));
        hold.v_WA.setZero();
      }
      both.holds.push_back(hold);
    }
    both.solve();
    for (const HoldPoint& hold : both.holds) {
      expect_law(both, hold, both.obstacles[0]->friction);
      pressed += hold.other && !hold.impulse_W.isZero(0);
    }
    for (const std::size_t tool : {0, 1}) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(both.unbalanced({Vector3::Unit(k), Vector3::Zero(), {}}, tool), 0, kOracle);
        EXPECT_NEAR(both.unbalanced({Vector3::Zero(), Vector3::Unit(k), {}}, tool), 0, kOracle);
      }
      EXPECT_NEAR(both.unbalanced({Vector3::Zero(), Vector3::Zero(), {1, 0}}, tool), 0, kOracle);
      EXPECT_NEAR(both.unbalanced({Vector3::Zero(), Vector3::Zero(), {0, 1}}, tool), 0, kOracle);
    }
  }
  EXPECT_GT(pressed, 100);
}

// Two walls, nearer to the tool than they should be, move on together: both gaps cannot grow, but
// neither needs to shrink.
TEST(HoldSolver, KeepsGapsThatCannotGrowWhileTissueMoves) {
  std::mt19937_64 random(12);
  HeldTools tool(random);
  tool.goal.wish[0] = {};
  tool.tools[0].hinges.clear();
  tool.bodies.resize(1);
  for (const Scalar side : {1.0, -1.0}) {
    HoldPoint hold;
    hold.nhat_AB_W = side * Vector3::UnitX();
    hold.p_WB = tool.goal.from[0].X_WT.translation();
    hold.p_WA = hold.p_WB - 0.05 * hold.nhat_AB_W;
    hold.v_WA = Vector3(0.4, 0, 0);
    tool.holds.push_back(hold);
  }
  tool.solve();
  EXPECT_NEAR(tool.steps[0].v_W.x(), 0.4, kOracle);
}

// Between two walls that close at nearly the angle of friction many solves are not given the time
// to come to their end. Whatever they leave, gaps are kept.
TEST(HoldSolver, KeepsGapsWhereItHasNoTimeToSolve) {
  std::mt19937_64 random(13);
  int unsolved = 0;
  for (int i = 0; i < 100; ++i) {
    HeldTools tool(random);
    tool.obstacles[0]->friction = 0.3;
    tool.goal.wish[0].v_W = Vector3(0, 0, random_number(-1, 1, random));
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
      const Vector3 u = tool.velocity(hold) - hold.v_WA;
      least = std::min(least, hold.nhat_AB_W.dot(u));
    }
    EXPECT_GE(least, -kOracle) << i;
    unsolved += std::abs(tool.unbalanced({Vector3::UnitZ(), Vector3::Zero(), {}})) > kOracle;
  }
  EXPECT_GT(unsolved, 10);
}

}  // namespace
}  // namespace dyop::haptics_internal
