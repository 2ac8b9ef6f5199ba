#pragma once

#include <gtest/gtest.h>

#include "dyop/contact/contact_cascade.h"
#include "dyop/contact/gauss_seidel_solver.h"

namespace dyop::testing {

/// Every contact solver: each gets all contract tests.
using AllContactSolvers = ::testing::Types<GaussSeidelSolver, ContactCascade>;

}  // namespace dyop::testing
