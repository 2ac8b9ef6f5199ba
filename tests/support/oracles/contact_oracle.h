// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/contact/contact_solver.h"

/// Checks solved contact problems against the laws stated in contact_problem.h, in world axes, from
/// velocities and impulses alone.
namespace dyop::testing {

/// The residual defined by ContactReport for the impulses and velocities in the problem.
/// Coefficients are those of the contacts; joints and turning friction are included.
Scalar contact_residual(const ContactProblem& problem);

/// Velocities must be the free ones plus the effect of the impulses, up to rounding: returns the
/// largest difference, divided by the largest speed involved.
Scalar momentum_error(const ContactProblem& problem);

/// Empty if Signorini's and Coulomb's laws hold up to a residual r, else what is broken:
///   normal impulses >= 0; |tangential impulse| <= friction * normal; u_n >= -(1 + friction) r;
///   normal impulse * u_n and the dissipation that friction misses (friction * normal * |u_t| +
///   tangential . u_t) at most r (|J| + |u~| / w + r / w) + (1 + friction) r normal. The reason:
///   residual r means that some J', u' with |J - J'| <= r / w, |u - u'| <= r obey the laws.
std::string broken_contact_law(const ContactProblem& problem, Scalar r);

}  // namespace dyop::testing
