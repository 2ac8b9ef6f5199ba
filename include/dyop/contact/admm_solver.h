// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/contact/contact_solver.h"

namespace DYOP_EXPORT dyop {

namespace contact_internal {
class AdmmRun;
}

/// Alternating direction method of multipliers: one factorisation over the bodies, then cheap
/// iterations, each a linear solve and a projection onto every cone ([Boyd2011]). Slow but robust:
/// for problems on which Newton cycles.
class AdmmSolver final : public ContactSolver {
 public:
  AdmmSolver();
  ~AdmmSolver() override;
  std::string_view name() const override { return "admm"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  std::unique_ptr<contact_internal::AdmmRun> run_;
};

}  // namespace dyop
