// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_solver.h"

#include <algorithm>

#include "contact/solver/contact_check.h"
#include "contact/solver/contact_system.h"
#include "core/tolerance.h"

namespace dyop {

ContactSolver::ContactSolver() : system_(std::make_unique<contact_internal::ContactSystem>()) {}
ContactSolver::~ContactSolver() = default;

ContactReport ContactSolver::solve(ContactProblem& problem, const ContactSolverOptions& options) {
  contact_internal::check_options(options);
  contact_internal::ContactSystem& system = *system_;
  system.build(problem);
  ContactReport report;
  report.solver = name();
  system.update_friction(problem);
  // A friction law is solved as a sequence of problems with constant coefficients.
  for (int round = 0; round < kContactFrictionRounds; ++round) {
    improve(system, options, report);
    system.update_velocities();
    system.update_friction(problem);
    report.residual = system.residual();
    if (!problem.friction_law || report.residual <= options.tolerance) break;
  }
  report.status =
      report.residual <= options.tolerance ? ContactStatus::Converged : ContactStatus::NotConverged;
  report.immovable_violations = system.immovable_violations(options.tolerance);
  system.write(problem);
  return report;
}

}  // namespace dyop
