// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_cascade.h"

#include <algorithm>
#include <array>
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
  if (system.velocities().size() <= kContactFewBodies) std::swap(order[0], order[1]);
  Scalar best = system.residual();
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
      if (best <= options.tolerance) return;
    }
    if (!(best < before)) return;  // the next round would change nothing
  }
}

Scalar contact_tolerance(Scalar largest_speed, Scalar standoff, Scalar h) {
  DYOP_REQUIRE(largest_speed >= 0, "speed must be >= 0, not ", largest_speed);
  DYOP_REQUIRE(standoff > 0 && h > 0, "standoff and step must be > 0, not ", standoff, " and ", h);
  constexpr Scalar kOfSpeed = 1e-3;
  return std::clamp(kOfSpeed * largest_speed, kOfSpeed * standoff / h, 0.1 * standoff / h);
}

}  // namespace dyop
