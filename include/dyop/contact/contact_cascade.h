// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/contact/admm_solver.h"
#include "dyop/contact/gauss_seidel_solver.h"
#include "dyop/contact/newton_solver.h"

namespace DYOP_EXPORT dyop {

/// The default solver: Gauss-Seidel, then Newton, then ADMM, each starting from the best answer so
/// far and within its own budget, until one converges; if none does, a second round. With one or
/// two bodies Newton comes first. Returns the answer with the smallest residual.
class ContactCascade final : public ContactSolver {
 public:
  std::string_view name() const override { return "cascade"; }

 protected:
  void improve(internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  GaussSeidelSolver gauss_seidel_;
  NewtonSolver newton_;
  AdmmSolver admm_;
  std::vector<Vector3> best_lambda_;
};

/// The solver tolerance for a step of length h and a standoff s (a length): 0.001 s / h for bodies
/// that hardly move, at most 0.1 s / h for fast ones, and 0.001 of their speed in between.
Scalar contact_tolerance(Scalar largest_speed, Scalar standoff, Scalar h);

}  // namespace dyop
