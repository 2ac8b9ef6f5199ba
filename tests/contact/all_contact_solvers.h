// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "dyop/contact/contact_solver.h"

namespace dyop::testing {

/// Every contact solver: each gets all contract tests.
using AllContactSolvers =
    ::testing::Types<GaussSeidelSolver, NewtonSolver, AdmmSolver, ContactCascade>;

}  // namespace dyop::testing
