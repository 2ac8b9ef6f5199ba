// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_law.h"
#include "contact/solver/contact_system.h"
#include "contact/solver/nonsmooth_newton.h"
#include "core/tolerance.h"
#include "dyop/contact/contact_solver.h"

namespace dyop {
namespace contact_internal {
namespace {

// Starting impulses whose residual is so small a part of that without impulses have nearly all
// contacts in the right state: then a large penalty diverges no more, and stands for fewer
// iterations. Found by measurement.
constexpr Scalar kNearStart = 1e-4;  // literal: a ratio of residuals
constexpr Scalar kNearPenalty = 3e5;

}  // namespace

// For multipliers lambda_k and De Saxce's shifts of an outer iteration, finds the y that minimises
//   1/2 |y|^2 + sum over blocks of max over lambda in C of
//       -lambda . u~ - |lambda - lambda_k|^2 / (2 rho) - compliance |lambda|^2 / 2,
// with u~ = free + G y + shift n: convex, once differentiable, Hessian I + sum of G^T rho P' G.
class NewtonRun {
 public:
  // Starts at the system's impulses.
  void begin(ContactSystem& system, const ContactSolverOptions& options);

  // Sets multipliers and shifts from the present y, and the penalty rho = factor / W_nn.
  void begin_outer(Scalar factor);

  enum class End { Converged, Minimised, Failed };
  // One outer iteration of at most `limit` factorisations, which it counts.
  End minimise(int limit, int& factorisations);

  // Steps on the whole law, shifts included, see NonsmoothNewton. Returns the number of
  // factorisations.
  int try_whole_law(const ContactSolverOptions& options, int limit);

  // Puts the impulses with the smallest residual into the system.
  void restore_best() { restore(best_lambda_, best_residual_); }
  // Penalty to begin with, times a contact's mobility.
  Scalar first_penalty() const {
    const bool is_near = best_residual_ <= kNearStart * system_->residual_without_impulses();
    return is_near ? kNearPenalty : kContactPenalty;
  }
  Scalar best_residual() const { return best_residual_; }
  bool is_lost() const { return !std::isfinite(residual_); }

 private:
  Vector3 raw_impulse(std::size_t i, const Vector3& u) const;  // before its projection onto C
  void compute_u(const std::vector<Vector6>& y, std::vector<Vector3>& u) const;
  void restore(const std::vector<Vector3>& lambda, Scalar residual);
  void compute_shifts();
  Scalar take_impulses();
  void keep_best();
  Scalar compute_gradient();
  bool compute_step();
  Scalar slope_at_start() const;
  Scalar slope(Scalar t) const;
  bool search_line();

  ContactSystem* system_ = nullptr;
  Scalar tolerance_ = 0;
  Interrupt* interrupt_ = nullptr;
  Scalar residual_ = kInfinity;  // of the impulses that are in the system
  Scalar outer_residual_ = kInfinity;
  Scalar best_residual_ = kInfinity;
  BodyMatrix matrix_;
  NonsmoothNewton whole_law_;
  std::vector<Vector3> lambda_, best_lambda_;
  std::vector<Scalar> rho_, shift_, radius_;
  std::vector<Scalar> penalty_;         // d lambda / d u, without P'
  std::vector<Vector3> lambda_by_rho_;  // lambda_ / rho_
  std::vector<Vector3> raw_;            // raw impulses at y_, of take_impulses()
  std::vector<Vector3> u_, du_;         // without compliance and shift
  std::vector<Vector6> y_, step_;
};

void NewtonRun::begin(ContactSystem& system, const ContactSolverOptions& options) {
  system_ = &system;
  tolerance_ = options.tolerance;
  interrupt_ = options.interrupt;
  const std::size_t count = system.blocks().size();
  for (auto* array : {&lambda_, &best_lambda_, &lambda_by_rho_, &raw_, &u_, &du_}) {
    array->resize(count);
  }
  for (auto* array : {&rho_, &penalty_, &shift_, &radius_}) array->resize(count);
  system.update_velocities();
  y_ = system.velocities();
  step_.resize(y_.size());
  for (std::size_t i = 0; i < count; ++i) best_lambda_[i] = system.blocks()[i].lambda;
  residual_ = system.residual();
  best_residual_ = residual_;
  outer_residual_ = residual_;
  compute_u(y_, u_);
}

void NewtonRun::begin_outer(Scalar factor) {
  const std::vector<Block>& blocks = system_->blocks();
  outer_residual_ = residual_;
  matrix_.analyse(*system_);
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    lambda_[i] = blocks[i].lambda;
    rho_[i] = factor / blocks[i].weight;
    penalty_[i] = rho_[i] / (1 + rho_[i] * blocks[i].compliance);
    lambda_by_rho_[i] = lambda_[i] / rho_[i];
  });
  compute_shifts();
}

void NewtonRun::compute_shifts() {
  const std::vector<Block>& blocks = system_->blocks();
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    const Block& block = blocks[i];
    const bool is_contact = block.kind == BlockKind::Contact;
    shift_[i] = is_contact ? block.friction * tangent_length(u_[i]) : 0;
    radius_[i] = block.owner >= 0 ? blocks[std::size_t(block.owner)].lambda[0] : 0;
  });
}

Vector3 NewtonRun::raw_impulse(std::size_t i, const Vector3& u) const {
  const Vector3& start = lambda_by_rho_[i];
  const Scalar factor = penalty_[i];
  return {factor * (start[0] - u[0] - shift_[i]), factor * (start[1] - u[1]),
          factor * (start[2] - u[2])};
}

void NewtonRun::compute_u(const std::vector<Vector6>& y, std::vector<Vector3>& u) const {
  const std::vector<Block>& blocks = system_->blocks();
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    const Block& block = blocks[i];
    u[i] = velocity_of(block, y);
    if (&u == &u_) u[i] += block.free;
  });
}

// Puts the impulses that belong to y into the system; returns their residual.
Scalar NewtonRun::take_impulses() {
  std::vector<Block>& blocks = system_->blocks();
  system_->loops().each(blocks.size(), [&](std::size_t i) {
    raw_[i] = raw_impulse(i, u_[i]);
    blocks[i].lambda = project(blocks[i], raw_[i], radius_[i]);
  });
  system_->update_velocities();
  residual_ = system_->residual();
  if (residual_ < best_residual_) keep_best();
  return residual_;
}

void NewtonRun::keep_best() {
  best_residual_ = residual_;
  const std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) best_lambda_[i] = blocks[i].lambda;
}

// Stores the negative gradient in step_. Returns its largest effect on a relative velocity.
Scalar NewtonRun::compute_gradient() {
  for (std::size_t i = 0; i < y_.size(); ++i) step_[i] = system_->velocities()[i] - y_[i];
  compute_u(step_, du_);
  return std::sqrt(
      system_->loops().largest(du_.size(), [&](std::size_t i) { return du_[i].squaredNorm(); }));
}

// The impulses at y_ have been taken.
bool NewtonRun::compute_step() {
  matrix_.reset();
  const std::vector<Block>& blocks = system_->blocks();
  matrix_.add_all(*system_, [&](std::size_t i) -> Matrix3 {
    return penalty_[i] * project_derivative(blocks[i], raw_[i], radius_[i]);
  });
  if (!matrix_.factorise(system_->loops())) return false;
  matrix_.solve(step_, system_->loops());
  compute_u(step_, du_);
  return true;
}

// slope(0): the impulses at y_ are in the system.
Scalar NewtonRun::slope_at_start() const {
  const std::vector<Block>& blocks = system_->blocks();
  Scalar sum = 0;
  for (std::size_t i = 0; i < y_.size(); ++i) sum += step_[i].dot(y_[i]);
  return system_->loops().sum(sum, blocks.size(),
                              [&](std::size_t i) { return -du_[i].dot(blocks[i].lambda); });
}

// Derivative of the objective along the step.
Scalar NewtonRun::slope(Scalar t) const {
  const std::vector<Block>& blocks = system_->blocks();
  Scalar sum = 0;
  for (std::size_t i = 0; i < y_.size(); ++i) sum += step_[i].dot(y_[i] + t * step_[i]);
  return system_->loops().sum(sum, blocks.size(), [&](std::size_t i) {
    const Vector3 u = u_[i] + t * du_[i];
    return -du_[i].dot(project(blocks[i], raw_impulse(i, u), radius_[i]));
  });
}

// Moves along the step to a point where the slope is at most half as steep. The slope grows with t.
bool NewtonRun::search_line() {
  const Scalar at_zero = slope_at_start();
  if (!(at_zero < 0 && at_zero > -kInfinity)) return false;
  Scalar low = 0;
  Scalar high = 1;
  Scalar slope_low = at_zero;
  Scalar slope_high = slope(1);
  Scalar t = 1;
  for (int i = 0; i < kContactLineLimit && slope_high > -at_zero / 2; ++i) {
    // False position, kept away from the ends.
    const Scalar part = slope_low / (slope_low - slope_high);
    t = low + (high - low) * std::clamp(part, Scalar{0.1}, Scalar{0.9});
    const Scalar here = slope(t);
    if (std::abs(here) <= -at_zero / 2) break;
    (here < 0 ? low : high) = t;
    (here < 0 ? slope_low : slope_high) = here;
  }
  for (std::size_t i = 0; i < y_.size(); ++i) y_[i] += t * step_[i];
  compute_u(y_, u_);
  return true;
}

NewtonRun::End NewtonRun::minimise(int limit, int& factorisations) {
  const Scalar goal = std::max(outer_residual_, tolerance_) * 0.1;
  for (int i = 0;; ++i) {
    if (take_impulses() <= tolerance_) return End::Converged;
    if (compute_gradient() <= goal) return End::Minimised;
    if (i == limit || is_over(interrupt_)) return End::Failed;
    ++factorisations;
    if (!compute_step() || !search_line()) return End::Failed;
  }
}

int NewtonRun::try_whole_law(const ContactSolverOptions& options, int limit) {
  const int used = whole_law_.run(*system_, options, limit);
  residual_ = system_->residual();
  if (residual_ < best_residual_) keep_best();
  y_ = system_->velocities();
  compute_u(y_, u_);
  return used;
}

void NewtonRun::restore(const std::vector<Vector3>& lambda, Scalar residual) {
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].lambda = lambda[i];
  residual_ = residual;
  system_->update_velocities();
  y_ = system_->velocities();
  compute_u(y_, u_);
}

}  // namespace contact_internal

NewtonSolver::NewtonSolver() : run_(std::make_unique<contact_internal::NewtonRun>()) {}
NewtonSolver::~NewtonSolver() = default;

void NewtonSolver::improve(contact_internal::ContactSystem& system,
                           const ContactSolverOptions& options, ContactReport& report) {
  using End = contact_internal::NewtonRun::End;
  if (options.newton_limit == 0 || is_over(options.interrupt)) return;
  run_->begin(system, options);
  int left = options.newton_limit;
  const auto try_whole_law = [&] {
    const int used = run_->try_whole_law(options, left);
    report.newton_iterations += used;
    left -= used;
    return run_->best_residual() <= options.tolerance;
  };
  if (try_whole_law()) return;
  Scalar factor = run_->first_penalty();
  int wait = 1;  // outer iterations until the whole law is tried again
  int next_wait = 2;
  contact_internal::Progress progress(run_->best_residual(), options.patience);
  while (left > 0 && !is_over(options.interrupt)) {
    const int done = options.newton_limit - left;
    if (progress.has_stalled(done, run_->best_residual())) break;
    if (wait-- <= 0) {
      if (try_whole_law() || left <= 0) break;
      wait = next_wait;
      next_wait *= 2;
    }
    int used = 0;
    run_->begin_outer(factor);
    const End end = run_->minimise(std::min(left, kContactInnerLimit), used);
    report.newton_iterations += used;
    left -= std::max(used, 1);
    if (end == End::Converged) break;
    if (end == End::Failed) {
      if (run_->is_lost()) run_->restore_best();
      factor = std::max(factor / 10, Scalar{1});
    } else if (used <= kContactInnerFew) {
      factor = std::max(factor, std::min(factor * 4, kContactLargestPenalty));
    }
  }
  run_->restore_best();
}

}  // namespace dyop
