// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/contact/contact_solver.h"

namespace DYOP_EXPORT dyop {

namespace contact_internal {
class NewtonRun;
}

/// Semismooth Newton on an augmented Lagrangian of the velocities, with De Saxce's shift for
/// Coulomb's law in an outer loop; near the solution, on the whole law including the shift. The
/// matrices are factorised in blocks over the bodies (docs/algorithms/contact_solvers.md). For
/// stacks, arches and everything stiff, and for one or two bodies.
class NewtonSolver final : public ContactSolver {
 public:
  NewtonSolver();
  ~NewtonSolver() override;
  std::string_view name() const override { return "newton"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  std::unique_ptr<contact_internal::NewtonRun> run_;
};

}  // namespace dyop
