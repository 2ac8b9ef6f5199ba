// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_law.h"
#include "contact/solver/contact_system.h"
#include "core/assert.h"
#include "core/tolerance.h"
#include "dyop/contact/contact_solver.h"

namespace dyop {
namespace contact_internal {

// Alternates between y, which minimises 1/2 |y|^2 + 1/2 rho |G y + free + shift - z + lambda /
// rho|^2 with one factorisation of I + rho G^T G for all iterations, and (z, lambda), which are a
// projection per block. De Saxce's shift follows y.
class AdmmRun {
 public:
  void begin(ContactSystem& system);
  bool factorise(Scalar factor);
  void iterate();
  // Ratio of the primal to the dual residual, which tells how to change the penalty.
  Scalar imbalance() const { return std::sqrt(primal_ / std::max(dual_, kSmallestDual)); }
  Scalar take_impulses();
  void end();

 private:
  // Over-relaxation compensates for part of each projection ([Boyd2011] 3.4.3).
  static constexpr Scalar kOverRelaxation = 1.6;
  static constexpr Scalar kSmallestDual = std::numeric_limits<Scalar>::min();

  void solve_velocities();

  ContactSystem* system_ = nullptr;
  Scalar best_residual_ = kInfinity;
  Scalar primal_ = 0;  // sum of rho |G y + free + shift - z|^2
  Scalar dual_ = 0;    // sum of rho |change of z|^2
  BodyMatrix matrix_;
  std::vector<Vector3> lambda_, best_lambda_, z_;
  std::vector<Scalar> rho_, shift_;
  std::vector<Vector6> y_;
};

void AdmmRun::begin(ContactSystem& system) {
  system_ = &system;
  const std::size_t count = system.blocks().size();
  for (auto* array : {&lambda_, &best_lambda_, &z_}) array->resize(count);
  rho_.resize(count);
  shift_.resize(count);
  system.update_velocities();
  y_ = system.velocities();
  best_residual_ = system.residual();
  matrix_.analyse(system);
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = system.blocks()[i];
    best_lambda_[i] = lambda_[i] = block.lambda;
    z_[i] = system.relative_velocity(block);
    shift_[i] = block.kind == BlockKind::Contact ? block.friction * z_[i].tail<2>().norm() : 0;
    z_[i][0] += shift_[i] - block.compliance * block.lambda[0];
  }
}

bool AdmmRun::factorise(Scalar factor) {
  matrix_.reset();
  for (std::size_t i = 0; i < rho_.size(); ++i) rho_[i] = factor / system_->blocks()[i].weight;
  matrix_.add_all(*system_,
                  [&](std::size_t i) -> Matrix3 { return rho_[i] * Matrix3::Identity(); });
  return matrix_.factorise(system_->loops());
}

void AdmmRun::solve_velocities() {
  for (Vector6& y : y_) y.setZero();
  const std::vector<Block>& blocks = system_->blocks();
  system_->add_impulses(y_, [&](std::size_t i) -> Vector3 {
    Vector3 push = z_[i] - blocks[i].free;
    push[0] -= shift_[i];
    return rho_[i] * push + lambda_[i];
  });
  matrix_.solve(y_, system_->loops());
}

void AdmmRun::iterate() {
  solve_velocities();
  primal_ = dual_ = 0;
  const std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    Vector3 u = block.free + velocity_of(block, y_);
    if (block.kind == BlockKind::Contact) shift_[i] = block.friction * u.tail<2>().norm();
    u[0] += shift_[i];
    DYOP_ASSERT(block.owner < int(lambda_.size()), block.owner);
    const Scalar normal = block.owner >= 0 ? lambda_[std::size_t(block.owner)][0] : 0;
    const Scalar soft = 1 / (1 + rho_[i] * block.compliance);
    const Vector3 x = kOverRelaxation * u + (1 - kOverRelaxation) * z_[i] - lambda_[i] / rho_[i];
    lambda_[i] = project(block, -soft * rho_[i] * x, normal);
    const Vector3 z = x + lambda_[i] / rho_[i];
    primal_ += rho_[i] * (u - z).squaredNorm();
    dual_ += rho_[i] * (z - z_[i]).squaredNorm();
    z_[i] = z;
  }
}

Scalar AdmmRun::take_impulses() {
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].lambda = lambda_[i];
  system_->update_velocities();
  const Scalar residual = system_->residual();
  if (residual < best_residual_) {
    best_residual_ = residual;
    best_lambda_ = lambda_;
  }
  return residual;
}

void AdmmRun::end() {
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].lambda = best_lambda_[i];
  system_->update_velocities();
}

}  // namespace contact_internal

AdmmSolver::AdmmSolver() : run_(std::make_unique<contact_internal::AdmmRun>()) {}
AdmmSolver::~AdmmSolver() = default;

void AdmmSolver::improve(contact_internal::ContactSystem& system,
                         const ContactSolverOptions& options, ContactReport& report) {
  constexpr int kCheckEvery = 5;     // the residual costs about half an iteration
  constexpr int kBalanceEvery = 20;  // a new penalty costs a factorisation
  constexpr Scalar kTooFar = 4;      // imbalance that calls for a new penalty
  if (options.admm_limit == 0 || is_over(options.interrupt)) return;
  run_->begin(system);
  Scalar factor = kContactFirstPenalty;
  bool has_factor = run_->factorise(factor);
  contact_internal::Progress progress(kInfinity, 2 * options.patience);
  Scalar least = kInfinity;  // from its own first check on, which is often worse than the start
  for (int i = 1; i <= options.admm_limit && has_factor; ++i) {
    if (is_over(options.interrupt)) break;
    ++report.admm_iterations;
    run_->iterate();
    if (i % kCheckEvery == 0) {
      least = std::min(least, run_->take_impulses());
      if (least <= options.tolerance || progress.has_stalled(i, least)) break;
    }
    if (i % kBalanceEvery != 0) continue;
    const Scalar imbalance = run_->imbalance();
    if (imbalance < kTooFar && imbalance > 1 / kTooFar) continue;
    factor *= std::clamp(imbalance, Scalar{0.1}, Scalar{10});
    has_factor = run_->factorise(factor);
  }
  run_->end();
}

}  // namespace dyop
