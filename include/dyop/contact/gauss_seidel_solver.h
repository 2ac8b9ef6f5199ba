// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/contact/contact_solver.h"

namespace DYOP_EXPORT dyop {

/// Projected block Gauss-Seidel: solves one contact after another exactly, forward and back
/// ([Jean1999]), with conjugate steps between the sweeps (NNCG, [Silcowitz2010]). Fast for few
/// contacts, and for a rough answer with many; slow to converge in tall stacks and arches.
class GaussSeidelSolver final : public ContactSolver {
 public:
  GaussSeidelSolver();
  ~GaussSeidelSolver() override;
  std::string_view name() const override { return "gauss_seidel"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace dyop
