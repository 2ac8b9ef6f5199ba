#include "dyop/contact/contact_cascade.h"

#include <algorithm>

#include "contact/contact_system.h"
#include "dyop/core/error.h"

namespace dyop {

void ContactCascade::improve(internal::ContactSystem& system, const ContactSolverOptions& options,
                             ContactReport& report) {
  ContactSolver& first = gauss_seidel_;
  first.improve(system, options, report);
  report.solver = gauss_seidel_.name();
}

Scalar contact_tolerance(Scalar largest_speed, Scalar standoff, Scalar h) {
  DYOP_REQUIRE(largest_speed >= 0, "speed must be >= 0, not ", largest_speed);
  DYOP_REQUIRE(standoff > 0 && h > 0, "standoff and step must be > 0, not ", standoff, " and ", h);
  constexpr Scalar kOfSpeed = 1e-3;
  return std::clamp(kOfSpeed * largest_speed, kOfSpeed * standoff / h, 0.1 * standoff / h);
}

}  // namespace dyop
