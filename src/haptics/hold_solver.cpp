// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/hold_solver.h"

#include <algorithm>
#include <cmath>

namespace dyop::haptics_internal {
namespace {

// A step opens a gap below the rest gap by this fraction of the difference, to avoid bouncing.
constexpr Scalar kOpening = 0.3;

// Solves aim at this fraction of the tolerance that they are accepted with: what sticks creeps by
// as much as a solve leaves, and a slow hand moves by little more than the tolerance in a tick.
constexpr Scalar kAim = 1e-4;  // literal: a ratio of residuals

// With so few unknowns, Newton beats Gauss-Seidel unless the sweeps converge at once.
constexpr int kSweeps = 4;

// Newton's method ends after so many factorisations times contacts, each with a constant part like
// that of so many contacts; some 100 us. More contacts than coordinates share their forces in many
// ways: what it has not solved then it hardly ever solves soon after, and the next tick goes on
// with its impulses.
constexpr std::size_t kFewContacts = 8;
constexpr int kFewWork = 360;
constexpr int kManyWork = 240;
constexpr int kFactorisation = 4;
constexpr int kFewestFactorisations = 10;

// The same without friction: what can be solved at all takes few. First with the demand that gaps
// grow, then that none shrinks.
constexpr int kGrowWork = 120;
constexpr int kKeepWork = 240;

// The body of the problem that stands still; those of the tools follow.
constexpr std::size_t kFixed = 0;

// What a factorisation counts for.
int size_of(const ContactProblem& problem) {
  return kFactorisation + int(problem.contacts.size() + problem.rows.size());
}

int newton_limit(const ContactProblem& problem, int work) {
  return std::max(kFewestFactorisations, work / size_of(problem));
}

Matrix3 inverse_diagonal(const Vector3& values) {
  return values.cwiseInverse().asDiagonal();
}

}  // namespace

HoldSolver::HoldSolver(std::span<const HapticTool> tools, std::span<const ToolBody> bodies,
                       std::size_t most_contacts)
    : tools_(tools.begin(), tools.end()), trocar_forces_W_(tools.size(), Vector3::Zero()) {
  std::size_t next = kFixed + 1;
  for (const HapticTool& tool : tools_) {
    frames_.push_back(next);
    next += 1 + tool.hinges.size();
  }
  for (const ToolBody& body : bodies) carriers_.push_back({body.tool, body.hinge});
  problem_.bodies.reserve(next);
  problem_.contacts.reserve(most_contacts);
  problem_.carriers.reserve(2 * most_contacts);
  problem_.rows.reserve(2 * tools_.size());
}

void HoldSolver::set_coupling(std::size_t tool, const CouplingOptions& coupling) {
  tools_[tool].coupling = coupling;
}

void HoldSolver::place_bodies(const StepGoal& goal) {
  problem_.bodies.clear();
  problem_.contacts.clear();
  problem_.carriers.clear();
  problem_.rows.clear();
  problem_.bodies.emplace_back();  // kFixed
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    if (goal.moving[k]) {
      place_tool(k, goal.from[k], goal.wish[k]);
    } else {
      problem_.bodies.resize(problem_.bodies.size() + 1 + tools_[k].hinges.size());
    }
  }
}

// All bodies are referred to T's origin.
void HoldSolver::place_tool(std::size_t tool, const ToolPose& from, const ToolStep& wish) {
  const CouplingOptions& springs = *tools_[tool].coupling;
  ContactBody frame;
  frame.inverse_mass_W = inverse_diagonal(springs.stiffness);
  frame.inverse_inertia_W = inverse_diagonal(springs.rotational_stiffness);
  frame.free_v_W = wish.v_W;
  frame.free_w_W = wish.w_W;
  problem_.bodies.push_back(frame);
  for (std::size_t k = 0; k < tools_[tool].hinges.size(); ++k) {
    const Vector3 axis = axis_of(from, tool, k);
    ContactBody angle;
    angle.inverse_inertia_W = axis * axis.transpose() / tools_[tool].hinges[k].stiffness;
    angle.free_w_W = -wish.angles[k] * axis;
    problem_.bodies.push_back(angle);
  }
}

// The point c of the axis that is nearest to the trocar P must come to it, across the axis: with e
// across, e . (v + w x (c - o)) = e . (P - c).
void HoldSolver::add_trocar(const StepGoal& goal, std::size_t tool) {
  const auto& trocar = tools_[tool].trocar;
  if (!trocar) return;
  const RigidPose& X_WT = goal.from[tool].X_WT;
  const Vector3 axis_W = (X_WT.rotation() * trocar->axis_T).normalized();
  const Vector3 p_W = X_WT * trocar->p_T;
  const Vector3 c_W = p_W + axis_W * axis_W.dot(trocar->p_W - p_W);
  Vector3 missing_W = trocar->p_W - c_W;
  const Scalar gap = missing_W.norm();
  if (gap > goal.recovery) missing_W *= goal.recovery / gap;
  const Vector3 first = axis_W.unitOrthogonal();
  for (const Vector3& across : {first, Vector3(axis_W.cross(first))}) {
    JointRow row;
    row.body_a = kFixed;
    row.body_b = frames_[tool];
    row.j_bv_W = across;
    row.j_bw_W = (c_W - X_WT.translation()).cross(across);
    row.target = across.dot(missing_W);
    row.impulse = across.dot(trocar_forces_W_[tool]);
    problem_.rows.push_back(row);
  }
}

Vector3 HoldSolver::axis_of(const ToolPose& from, std::size_t tool, std::size_t hinge) const {
  return (from.X_WT.rotation() * tools_[tool].hinges[hinge].X_TJ.rotation()).col(2);
}

// From the hinge that carries a body, or else from T's origin.
Vector3 HoldSolver::arm(const StepGoal& goal, const Carrier& carrier, const Vector3& p_W) const {
  const RigidPose& X_WT = goal.from[carrier.tool].X_WT;
  if (!carrier.hinge) return p_W - X_WT.translation();
  return p_W - X_WT * tools_[carrier.tool].hinges[*carrier.hinge].X_TJ.translation();
}

// A point of a jaw moves by v + w x r + angle axis x (r - hinge): relative to the body of the
// angle, which turns backwards, it moves as a point of the frame would.
void HoldSolver::add_hold(const StepGoal& goal, const Obstacle& obstacle, const HoldPoint& hold) {
  const Carrier& carrier = carriers_[hold.body];
  const Vector3 v_WA = goal.duration * hold.v_WA;
  PointContact contact;
  contact.body_a = kFixed;
  contact.body_b = frames_[carrier.tool];
  contact.r_b_W = hold.p_WB - goal.from[carrier.tool].X_WT.translation();
  if (hold.other) {
    add_other_tool(goal, hold, contact);
  } else if (carrier.hinge) {
    contact.body_a = angle_of(carrier);
    contact.r_a_W = arm(goal, carrier, hold.p_WB);
  }
  contact.nhat_AB_W = hold.nhat_AB_W;
  contact.sticking_velocity_W = v_WA;
  // The least gap at the end.
  const Scalar missing = obstacle.margin + goal.rest_gap + hold.push - hold.gap();
  const Scalar opened = missing > 0 ? std::min(kOpening * missing, goal.recovery) : missing;
  // A turn may open the gap later than the linear part of the step closes it: that counts only as
  // far as there is more gap than needed at the start.
  const Scalar curvature = std::min(hold.curvature, std::max(Scalar{0}, -missing));
  contact.target = v_WA.dot(hold.nhat_AB_W) + opened - curvature;
  contact.friction = obstacle.friction;
  contact.impulse_W = hold.impulse_W;
  problem_.contacts.push_back(contact);
}

// Both sides move, each with its hinge, if it is on one.
void HoldSolver::add_other_tool(const StepGoal& goal, const HoldPoint& hold,
                                PointContact& contact) {
  const Carrier& body = carriers_[hold.body];
  const Carrier& other = carriers_[*hold.other];
  contact.body_a = frames_[other.tool];
  contact.r_a_W = hold.p_WA - goal.from[other.tool].X_WT.translation();
  const std::size_t number = problem_.contacts.size();
  if (body.hinge) {
    problem_.carriers.push_back({number, angle_of(body), true, arm(goal, body, hold.p_WB)});
  }
  if (other.hinge) {
    problem_.carriers.push_back({number, angle_of(other), false, arm(goal, other, hold.p_WA)});
  }
}

bool HoldSolver::run(const StepGoal& goal, int limit, WorkClock& clock) {
  ContactSolverOptions options;
  options.tolerance = kAim * goal.tolerance;
  options.interrupt = &clock;
  options.sweep_limit = kSweeps;
  options.few_sweep_limit = kSweeps;
  // What these do not solve asks for what is impossible; more work hardly ever helps.
  options.cascade_rounds = 1;
  options.admm_limit = 0;
  options.restart_contacts = 0;
  options.newton_limit = limit;
  const ContactReport report = solver_.solve(problem_, options);
  clock.add_work(report.newton_iterations * size_of(problem_));
  return report.residual <= goal.tolerance;
}

ToolSteps HoldSolver::read_steps(const StepGoal& goal) const {
  ToolSteps steps(tools_.size());
  for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
    const ContactBody* body = &problem_.bodies[frames_[tool]];
    steps[tool].v_W = body->v_W;
    steps[tool].w_W = body->w_W;
    for (std::size_t k = 0; k < tools_[tool].hinges.size(); ++k) {
      steps[tool].angles[k] = -axis_of(goal.from[tool], tool, k).dot((++body)->w_W);
    }
  }
  return steps;
}

void HoldSolver::build(const StepGoal& goal, Obstacles obstacles,
                       std::span<const HoldPoint> holds) {
  place_bodies(goal);
  for (std::size_t k = 0; k < tools_.size(); ++k) add_trocar(goal, k);
  for (const HoldPoint& hold : holds) add_hold(goal, *obstacles[hold.obstacle], hold);
}

// Where friction all but jams the tool, solvers need thousands of iterations, and an unsolved step
// lets gaps shrink, if only by a little. At the least gap that a proof admits neither tool nor
// tissue could then move, and the next tick would begin with the same problem: for ever. So finds
// the step nearest to the one found that keeps all gaps, without friction: a convex problem, which
// is solved in a few iterations whenever there is such a step.
void HoldSolver::keep_gaps(const StepGoal& goal, Obstacles obstacles,
                           std::span<const HoldPoint> holds, WorkClock& clock) {
  StepGoal near = goal;
  near.wish = read_steps(goal);
  build(near, obstacles, holds);
  for (PointContact& contact : problem_.contacts) {
    contact.friction = 0;
    contact.impulse_W.setZero();
  }
  if (run(goal, newton_limit(problem_, kGrowWork), clock) || clock.cutoff()) return;
  // Demands that gaps grow can contradict each other; that none shrinks can be met unless tissue
  // closes in from all sides.
  for (PointContact& contact : problem_.contacts) {
    const Scalar with_tissue = contact.sticking_velocity_W.dot(contact.nhat_AB_W);
    contact.target = std::min(contact.target, with_tissue);
  }
  is_contradiction_ = !run(goal, newton_limit(problem_, kKeepWork), clock);
}

ToolSteps HoldSolver::solve(const StepGoal& goal, Obstacles obstacles,
                            std::vector<HoldPoint>& holds, WorkClock& clock) {
  is_contradiction_ = false;
  build(goal, obstacles, holds);
  const int work = problem_.contacts.size() <= kFewContacts ? kFewWork : kManyWork;
  const bool is_solved = run(goal, newton_limit(problem_, work), clock);
  for (std::size_t k = 0; k < holds.size(); ++k) {
    holds[k].impulse_W = problem_.contacts[k].impulse_W;
  }
  for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
    trocar_forces_W_[tool].setZero();
    for (const JointRow& row : problem_.rows) {
      if (row.body_b == frames_[tool]) trocar_forces_W_[tool] += row.impulse * row.j_bv_W;
    }
  }
  if (!is_solved && !clock.cutoff()) keep_gaps(goal, obstacles, holds, clock);
  if (clock.cutoff()) return ToolSteps(tools_.size());
  return read_steps(goal);
}

}  // namespace dyop::haptics_internal
