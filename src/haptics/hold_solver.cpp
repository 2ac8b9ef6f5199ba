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

// The bodies of the problem: the tool's frame, one that stands still, and one for each angle.
constexpr std::size_t kFrame = 0, kFixed = 1, kFirstHinge = 2;

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

HoldSolver::HoldSolver(const CouplingOptions& coupling, std::span<const ToolHinge> hinges,
                       std::span<const ToolBody> bodies, const std::optional<ToolTrocar>& trocar,
                       std::size_t most_contacts)
    : hinges_(hinges.begin(), hinges.end()), trocar_(trocar) {
  set_coupling(coupling);
  for (const ToolBody& body : bodies) hinge_of_body_.push_back(body.hinge);
  problem_.bodies.reserve(kFirstHinge + hinges_.size());
  problem_.contacts.reserve(most_contacts);
  problem_.rows.reserve(2);
}

void HoldSolver::set_coupling(const CouplingOptions& coupling) {
  inverse_stiffness_ = inverse_diagonal(coupling.stiffness);
  inverse_turn_stiffness_ = inverse_diagonal(coupling.rotational_stiffness);
}

// All bodies are referred to T's origin.
void HoldSolver::place_bodies(const StepGoal& goal) {
  problem_.bodies.clear();
  problem_.contacts.clear();
  problem_.rows.clear();
  ContactBody frame;
  frame.inverse_mass_W = inverse_stiffness_;
  frame.inverse_inertia_W = inverse_turn_stiffness_;
  frame.free_v_W = goal.wish.v_W;
  frame.free_w_W = goal.wish.w_W;
  problem_.bodies.push_back(frame);
  problem_.bodies.emplace_back();
  for (std::size_t k = 0; k < hinges_.size(); ++k) {
    const Vector3 axis = axis_of(goal, k);
    ContactBody angle;
    angle.inverse_inertia_W = axis * axis.transpose() / hinges_[k].stiffness;
    angle.free_w_W = -goal.wish.angles[k] * axis;
    problem_.bodies.push_back(angle);
  }
}

// The point c of the axis that is nearest to the trocar P must come to it, across the axis: with e
// across, e . (v + w x (c - o)) = e . (P - c).
void HoldSolver::add_trocar(const StepGoal& goal) {
  if (!trocar_) return;
  const RigidPose& X_WT = goal.from.X_WT;
  const Vector3 axis_W = (X_WT.rotation() * trocar_->axis_T).normalized();
  const Vector3 p_W = X_WT * trocar_->p_T;
  const Vector3 c_W = p_W + axis_W * axis_W.dot(trocar_->p_W - p_W);
  Vector3 missing_W = trocar_->p_W - c_W;
  const Scalar gap = missing_W.norm();
  if (gap > goal.recovery) missing_W *= goal.recovery / gap;
  const Vector3 first = axis_W.unitOrthogonal();
  for (const Vector3& across : {first, Vector3(axis_W.cross(first))}) {
    JointRow row;
    row.body_a = kFixed;
    row.body_b = kFrame;
    row.j_bv_W = across;
    row.j_bw_W = (c_W - X_WT.translation()).cross(across);
    row.target = across.dot(missing_W);
    row.impulse = across.dot(trocar_force_W_);
    problem_.rows.push_back(row);
  }
}

Vector3 HoldSolver::axis_of(const StepGoal& goal, std::size_t hinge) const {
  return (goal.from.X_WT.rotation() * hinges_[hinge].X_TJ.rotation()).col(2);
}

// A point of a jaw moves by v + w x r + angle axis x (r - hinge): relative to the body of the
// angle, which turns backwards, it moves as a point of the frame would.
void HoldSolver::add_hold(const StepGoal& goal, const Obstacle& obstacle, const HoldPoint& hold) {
  const Vector3 v_WA = goal.duration * hold.v_WA;
  PointContact contact;
  contact.body_a = kFixed;
  contact.body_b = kFrame;
  contact.r_b_W = hold.p_WB - goal.from.X_WT.translation();
  if (const auto& hinge = hinge_of_body_[hold.body]) {
    contact.body_a = kFirstHinge + *hinge;
    contact.r_a_W = hold.p_WB - goal.from.X_WT * hinges_[*hinge].X_TJ.translation();
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

ToolStep HoldSolver::read_step(const StepGoal& goal) const {
  ToolStep step;
  step.v_W = problem_.bodies[kFrame].v_W;
  step.w_W = problem_.bodies[kFrame].w_W;
  for (std::size_t k = 0; k < hinges_.size(); ++k) {
    step.angles[k] = -axis_of(goal, k).dot(problem_.bodies[kFirstHinge + k].w_W);
  }
  return step;
}

void HoldSolver::build(const StepGoal& goal, Obstacles obstacles,
                       std::span<const HoldPoint> holds) {
  place_bodies(goal);
  add_trocar(goal);
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
  near.wish = read_step(goal);
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

ToolStep HoldSolver::solve(const StepGoal& goal, Obstacles obstacles, std::vector<HoldPoint>& holds,
                           WorkClock& clock) {
  is_contradiction_ = false;
  build(goal, obstacles, holds);
  const int work = problem_.contacts.size() <= kFewContacts ? kFewWork : kManyWork;
  const bool is_solved = run(goal, newton_limit(problem_, work), clock);
  for (std::size_t k = 0; k < holds.size(); ++k) {
    holds[k].impulse_W = problem_.contacts[k].impulse_W;
  }
  trocar_force_W_.setZero();
  for (const JointRow& row : problem_.rows) trocar_force_W_ += row.impulse * row.j_bv_W;
  if (!is_solved && !clock.cutoff()) keep_gaps(goal, obstacles, holds, clock);
  if (clock.cutoff()) return {};
  return read_step(goal);
}

}  // namespace dyop::haptics_internal
