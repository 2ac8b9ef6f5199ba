// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_cascade.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "contact/solver/contact_system.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

void keep(const internal::ContactSystem& system, std::vector<Vector3>& lambda) {
  lambda.clear();
  for (const internal::Block& block : system.blocks()) lambda.push_back(block.lambda);
}

void restore(internal::ContactSystem& system, const std::vector<Vector3>& lambda) {
  for (std::size_t i = 0; i < lambda.size(); ++i) system.blocks()[i].lambda = lambda[i];
  system.update_velocities();
}

}  // namespace

void ContactCascade::improve(internal::ContactSystem& system, const ContactSolverOptions& options,
                             ContactReport& report) {
  std::array<ContactSolver*, 3> order{&gauss_seidel_, &newton_, &admm_};
  Scalar best = system.residual();
  if (best <= options.tolerance) return;  // at rest the last impulses still do
  const bool is_good_start = best <= kContactGoodStart * system.residual_without_impulses();
  if (is_good_start || system.velocities().size() <= kContactFewBodies) {
    std::swap(order[0], order[1]);
  }
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
