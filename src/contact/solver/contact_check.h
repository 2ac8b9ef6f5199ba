// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/contact/contact_problem.h"
#include "dyop/contact/contact_solver.h"

namespace dyop::internal {

// Throw InvalidArgument naming the value that breaks what contact_problem.h and contact_solver.h
// ask for.
void check_problem(const ContactProblem& problem);
void check_options(const ContactSolverOptions& options);
void check_friction(Scalar friction, std::size_t contact);

}  // namespace dyop::internal
