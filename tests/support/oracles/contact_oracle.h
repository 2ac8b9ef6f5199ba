// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/contact/contact_solver.h"

/// Judges solved contact problems by the laws as contact_problem.h states them, in world axes, from
/// velocities and impulses alone.
namespace dyop::testing {

/// The residual that ContactReport defines, of the impulses and velocities in the problem.
/// Coefficients are those of the contacts; joints and turning friction included.
Scalar contact_residual(const ContactProblem& problem);

/// Velocities are the free ones plus what the impulses do, up to rounding: the largest difference
/// over the largest speed involved.
Scalar momentum_error(const ContactProblem& problem);

/// An empty text if Signorini's and Coulomb's laws hold up to a residual r, else what is broken:
///   normal impulses >= 0; |tangential impulse| <= friction * normal; u_n >= -(1 + friction) r;
///   normal impulse * u_n and the dissipation that friction misses (friction * normal * |u_t| +
///   tangential . u_t) at most r (|J| + |u~| / w + r / w) + (1 + friction) r normal.
/// Why: residual r means that some J', u' with |J - J'| <= r / w, |u - u'| <= r obey the laws.
std::string broken_contact_law(const ContactProblem& problem, Scalar r);

}  // namespace dyop::testing
