// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "dyop/contact/admm_solver.h"
#include "dyop/contact/contact_cascade.h"
#include "dyop/contact/gauss_seidel_solver.h"
#include "dyop/contact/newton_solver.h"

namespace dyop::testing {

/// Every contact solver: each gets all contract tests.
using AllContactSolvers =
    ::testing::Types<GaussSeidelSolver, NewtonSolver, AdmmSolver, ContactCascade>;

}  // namespace dyop::testing
