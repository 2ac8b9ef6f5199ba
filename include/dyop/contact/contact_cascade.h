// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "dyop/contact/admm_solver.h"
#include "dyop/contact/gauss_seidel_solver.h"
#include "dyop/contact/newton_solver.h"

namespace DYOP_EXPORT dyop {

namespace contact_internal {
class ContactRestart;
class InteriorPointSolver;
}  // namespace contact_internal

/// The default solver: Gauss-Seidel, then Newton, then ADMM, each starting from the best answer so
/// far and within its own budget, until one converges; if none does, a second round. With one or
/// two bodies Newton comes first. Where bodies seem to rest, interior points do before all of them;
/// their factorisations count as Newton's. What no round solves, and has few contacts, is begun
/// again: by continuation from the problem without friction, then from random impulses, the same
/// in every run. Returns the answer with the smallest residual.
class ContactCascade final : public ContactSolver {
 public:
  ContactCascade();
  ~ContactCascade() override;
  std::string_view name() const override { return "cascade"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  Scalar run_round(contact_internal::ContactSystem& system, Scalar best,
                   const ContactSolverOptions& options, ContactReport& report);
  void restart(contact_internal::ContactSystem& system, Scalar best,
               const ContactSolverOptions& options, ContactReport& report);

  std::unique_ptr<contact_internal::InteriorPointSolver> interior_;
  GaussSeidelSolver gauss_seidel_;
  NewtonSolver newton_;
  AdmmSolver admm_;
  std::array<ContactSolver*, 3> order_{};
  std::unique_ptr<contact_internal::ContactRestart> restart_;
  std::vector<Vector3> first_lambda_, best_lambda_;
};

/// The tolerance for a step of length h that keeps a rest offset s (a length), by the way
/// x = speed h / s of the fastest body: 1e-6 max(x, x^2) s / h, but at least 1e-7 s / h, for bodies
/// at rest, and at most 0.1 s / h.
Scalar contact_tolerance(Scalar largest_speed, Scalar rest_offset, Scalar h);

}  // namespace dyop
