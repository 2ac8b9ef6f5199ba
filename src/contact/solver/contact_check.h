// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/contact/contact_problem.h"
#include "dyop/contact/contact_solver.h"

namespace dyop::contact_internal {

// Throw InvalidArgument, naming the value, for input that contact_problem.h and contact_solver.h do
// not allow.
void check_problem(const ContactProblem& problem);
void check_options(const ContactSolverOptions& options);
void check_friction(Scalar friction, std::size_t contact);

}  // namespace dyop::contact_internal
