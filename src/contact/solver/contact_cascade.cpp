// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_cascade.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "contact/solver/contact_restart.h"
#include "contact/solver/contact_system.h"
#include "contact/solver/resting_solver.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

// Bodies seem to rest if the tolerance is at most this part of the residual without impulses:
// contact_tolerance() asks for so little only where nothing moves by much more than a rest offset per
// step. Found by measurement.
constexpr Scalar kRestingPart = 3e-5;  // literal: a ratio of residuals

void keep(const contact_internal::ContactSystem& system, std::vector<Vector3>& lambda) {
  lambda.clear();
  for (const contact_internal::Block& block : system.blocks()) lambda.push_back(block.lambda);
}

void restore(contact_internal::ContactSystem& system, const std::vector<Vector3>& lambda) {
  for (std::size_t i = 0; i < lambda.size(); ++i) system.blocks()[i].lambda = lambda[i];
  system.update_velocities();
}

}  // namespace

ContactCascade::ContactCascade()
    : resting_(std::make_unique<contact_internal::RestingSolver>()),
      restart_(std::make_unique<contact_internal::ContactRestart>()) {}
ContactCascade::~ContactCascade() = default;

// Solvers one after the other, each from the best answer so far, which is left in the system. `best`
// is the residual before.
Scalar ContactCascade::run_round(contact_internal::ContactSystem& system, Scalar best,
                                 const ContactSolverOptions& options, ContactReport& report) {
  for (ContactSolver* solver : order_) {
    if (best <= options.tolerance || is_over(options.interrupt)) break;
    keep(system, best_lambda_);
    solver->improve(system, options, report);
    system.update_velocities();
    const Scalar residual = system.residual();
    if (residual < best) {
      best = residual;
      report.solver = solver->name();
    } else {
      restore(system, best_lambda_);
    }
  }
  return best;
}

void ContactCascade::improve(contact_internal::ContactSystem& system,
                             const ContactSolverOptions& options, ContactReport& report) {
  order_ = {&gauss_seidel_, &newton_, &admm_};
  Scalar best = system.residual();
  if (best <= options.tolerance) return;  // at rest the last impulses still do
  const Scalar without_impulses = system.residual_without_impulses();
  const bool is_small = system.velocities().size() <= kContactFewBodies;
  if (!is_small && options.tolerance <= kRestingPart * without_impulses) {
    resting_->improve(system, options, report);
    best = system.residual();
    if (best <= options.tolerance) {
      report.solver = "interior points";
      return;
    }
  }
  if (is_small || best <= kContactGoodStart * without_impulses) std::swap(order_[0], order_[1]);
  for (int round = 0; round < options.cascade_rounds; ++round) {
    const Scalar before = std::exchange(best, run_round(system, best, options, report));
    if (best <= options.tolerance || is_over(options.interrupt)) return;
    if (!(best < before)) break;  // the next round would change nothing
  }
  restart(system, best, options, report);
}

// The best answer yet is in the system, with this residual.
void ContactCascade::restart(contact_internal::ContactSystem& system, Scalar best,
                             const ContactSolverOptions& options, ContactReport& report) {
  if (system.blocks().size() > std::size_t(options.restart_contacts)) return;
  const std::string_view solver = report.solver;
  keep(system, first_lambda_);
  restart_->begin(system);
  for (int k = 0; options.friction_steps > 0 && k <= options.friction_steps; ++k) {
    restart_->set_friction(system, Scalar(k) / options.friction_steps);
    run_round(system, system.residual(), options, report);
  }
  for (int k = 0; k < options.scattered_starts; ++k) {
    if (system.residual() <= options.tolerance || is_over(options.interrupt)) break;
    restart_->scatter(system);
    run_round(system, system.residual(), options, report);
  }
  restart_->set_friction(system, 1);
  if (system.residual() < best) return;
  restore(system, first_lambda_);
  report.solver = solver;
}

Scalar contact_tolerance(Scalar largest_speed, Scalar rest_offset, Scalar h) {
  DYOP_REQUIRE(largest_speed >= 0, "speed must be >= 0, not ", largest_speed);
  DYOP_REQUIRE(rest_offset > 0 && h > 0, "rest_offset and step must be > 0, not ", rest_offset,
               " and ", h);
  const Scalar way = largest_speed * h / rest_offset;  // in a step, in rest offsets
  return std::clamp(kContactSpeedTolerance * way * std::max(way, Scalar{1}), kContactRestTolerance,
                    kContactLooseTolerance) *
         rest_offset / h;
}

}  // namespace dyop
