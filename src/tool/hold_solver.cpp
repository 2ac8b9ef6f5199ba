// SPDX-License-Identifier: BSD-3-Clause
#include "tool/hold_solver.h"

#include <algorithm>
#include <cmath>

namespace dyop::internal {
namespace {

// Fraction of the frame's stiffness that a jaw has by itself: too little to hold the tool, enough
// for the solver's arithmetic.
constexpr Scalar kJawShare = 1e-3;

// A step opens a gap below the rest gap by this fraction of the difference, to avoid bouncing.
constexpr Scalar kOpening = 0.3;

Matrix3 inverse_diagonal(const Vector3& values) {
  return values.cwiseInverse().asDiagonal();
}

}  // namespace

HoldSolver::HoldSolver(const CouplingOptions& coupling, std::span<const ToolHinge> hinges,
                       std::span<const ToolBody> bodies, std::size_t most_contacts)
    : inverse_stiffness_(inverse_diagonal(coupling.stiffness)),
      inverse_turn_stiffness_(inverse_diagonal(coupling.rotational_stiffness)),
      length_(std::sqrt(coupling.rotational_stiffness.mean() / coupling.stiffness.mean())),
      hinges_(hinges.begin(), hinges.end()) {
  for (const ToolBody& body : bodies) hinge_of_body_.push_back(body.hinge);
  problem_.bodies.reserve(1 + hinges_.size() + most_contacts);
  problem_.contacts.reserve(most_contacts);
  problem_.rows.reserve(6 * hinges_.size());
}

std::size_t HoldSolver::body_of(const HoldPoint& hold) const {
  const auto& hinge = hinge_of_body_[hold.body];
  return hinge ? 1 + *hinge : 0;
}

// All bodies of the tool are referred to T's origin.
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
  for (std::size_t k = 0; k < hinges_.size(); ++k) add_hinge(goal, k);
}

// A jaw: fixed to the frame except for its angle, which a spring drives.
void HoldSolver::add_hinge(const StepGoal& goal, std::size_t number) {
  const RigidPose X_WJ = goal.from.X_WT * hinges_[number].X_TJ;
  const Vector3 axis = X_WJ.rotation().col(2);
  const Vector3 lever = X_WJ.translation() - goal.from.X_WT.translation();
  const Scalar turn = goal.wish.angles[number];
  ContactBody jaw = problem_.bodies[0];
  jaw.inverse_mass_W /= kJawShare;
  jaw.inverse_inertia_W /= kJawShare;
  jaw.free_v_W -= turn * axis.cross(lever);
  jaw.free_w_W += turn * axis;
  problem_.bodies.push_back(jaw);
  const auto add_row = [&](const Vector3& along_v, const Vector3& along_w, Scalar target,
                           Scalar compliance) {
    JointRow row;
    row.body_a = 0;
    row.body_b = 1 + number;
    row.j_av_W = -along_v;
    row.j_aw_W = -along_w;
    row.j_bv_W = along_v;
    row.j_bw_W = along_w;
    row.target = target;
    row.compliance = compliance;
    problem_.rows.push_back(row);
  };
  for (int k = 0; k < 3; ++k) {
    // The velocity of the hinge's point, v + w x lever, is the same for both.
    const Vector3 e = Vector3::Unit(k);
    add_row(e, lever.cross(e), 0, 0);
  }
  for (int k = 0; k < 2; ++k) add_row(Vector3::Zero(), length_ * X_WJ.rotation().col(k), 0, 0);
  add_row(Vector3::Zero(), length_ * axis, length_ * turn,
          length_ * length_ / hinges_[number].stiffness);
}

void HoldSolver::add_hold(const StepGoal& goal, const Obstacle& obstacle, const HoldPoint& hold) {
  PointContact contact;
  contact.body_a = problem_.bodies.size();
  ContactBody tissue;
  tissue.free_v_W = goal.duration * hold.v_WA;
  problem_.bodies.push_back(tissue);
  contact.body_b = body_of(hold);
  contact.r_b_W = hold.p_WB - goal.from.X_WT.translation();
  contact.nhat_AB_W = hold.nhat_AB_W;
  // The least gap at the end.
  const Scalar missing = obstacle.margin + goal.rest_gap + hold.push - hold.gap();
  const Scalar opened = missing > 0 ? std::min(kOpening * missing, goal.recovery) : missing;
  contact.target = opened - hold.curvature;
  contact.friction = obstacle.friction;
  contact.impulse_W = hold.impulse_W;
  problem_.contacts.push_back(contact);
}

bool HoldSolver::run(const StepGoal& goal, WorkClock& clock) {
  ContactSolverOptions options;
  options.tolerance = goal.tolerance;
  options.interrupt = &clock;
  // What these do not solve asks for what is impossible; more work hardly ever helps.
  options.cascade_rounds = 1;
  options.admm_limit = 0;
  options.restart_contacts = 0;
  return solver_.solve(problem_, options).status == ContactStatus::Converged;
}

ToolStep HoldSolver::read_step(const StepGoal& goal) const {
  ToolStep step;
  step.v_W = problem_.bodies[0].v_W;
  step.w_W = problem_.bodies[0].w_W;
  for (std::size_t k = 0; k < hinges_.size(); ++k) {
    const Vector3 axis = (goal.from.X_WT.rotation() * hinges_[k].X_TJ.rotation()).col(2);
    step.angles[k] = axis.dot(problem_.bodies[1 + k].w_W - problem_.bodies[0].w_W);
  }
  return step;
}

void HoldSolver::build(const StepGoal& goal, Obstacles obstacles,
                       std::span<const HoldPoint> holds) {
  place_bodies(goal);
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
  if (run(goal, clock) || clock.cutoff()) return;
  // Demands that gaps grow can contradict each other; that none shrinks can be met unless tissue
  // closes in from all sides.
  for (PointContact& contact : problem_.contacts) {
    contact.target = std::min(contact.target, Scalar{0});
  }
  run(goal, clock);
}

ToolStep HoldSolver::solve(const StepGoal& goal, Obstacles obstacles, std::vector<HoldPoint>& holds,
                           WorkClock& clock) {
  build(goal, obstacles, holds);
  const bool is_solved = run(goal, clock);
  for (std::size_t k = 0; k < holds.size(); ++k) {
    holds[k].impulse_W = problem_.contacts[k].impulse_W;
  }
  if (!is_solved && !clock.cutoff()) keep_gaps(goal, obstacles, holds, clock);
  if (clock.cutoff()) return {};
  return read_step(goal);
}

}  // namespace dyop::internal
