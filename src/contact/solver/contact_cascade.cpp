// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_cascade.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "contact/solver/contact_system.h"
#include "contact/solver/resting_solver.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

// Bodies seem to rest if the tolerance is at most this part of the residual without impulses:
// contact_tolerance() asks for so little only where nothing moves by much more than a standoff per
// step. Found by measurement.
constexpr Scalar kRestingPart = 3e-5;  // literal: a ratio of residuals

void keep(const internal::ContactSystem& system, std::vector<Vector3>& lambda) {
  lambda.clear();
  for (const internal::Block& block : system.blocks()) lambda.push_back(block.lambda);
}

void restore(internal::ContactSystem& system, const std::vector<Vector3>& lambda) {
  for (std::size_t i = 0; i < lambda.size(); ++i) system.blocks()[i].lambda = lambda[i];
  system.update_velocities();
}

}  // namespace

ContactCascade::ContactCascade() : resting_(std::make_unique<internal::RestingSolver>()) {}
ContactCascade::~ContactCascade() = default;

void ContactCascade::improve(internal::ContactSystem& system, const ContactSolverOptions& options,
                             ContactReport& report) {
  std::array<ContactSolver*, 3> order{&gauss_seidel_, &newton_, &admm_};
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
  if (is_small || best <= kContactGoodStart * without_impulses) std::swap(order[0], order[1]);
  for (int round = 0; round < options.cascade_rounds; ++round) {
    const Scalar before = best;
    for (ContactSolver* solver : order) {
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
      if (best <= options.tolerance || is_over(options.interrupt)) return;
    }
    if (!(best < before)) return;  // the next round would change nothing
  }
}

Scalar contact_tolerance(Scalar largest_speed, Scalar standoff, Scalar h) {
  DYOP_REQUIRE(largest_speed >= 0, "speed must be >= 0, not ", largest_speed);
  DYOP_REQUIRE(standoff > 0 && h > 0, "standoff and step must be > 0, not ", standoff, " and ", h);
  const Scalar way = largest_speed * h / standoff;  // in a step, in standoffs
  return std::clamp(kContactSpeedTolerance * way * std::max(way, Scalar{1}), kContactRestTolerance,
                    kContactLooseTolerance) *
         standoff / h;
}

}  // namespace dyop
