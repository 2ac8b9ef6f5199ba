// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "contact/solver/contact_system.h"

namespace dyop::contact_internal {

// Other starting points for a problem that the solvers did not solve from the one they were given.
// With friction there may be several solutions, and iterations that circle between two wrong states.
class ContactRestart {
 public:
  // Keeps the problem's coefficients of friction.
  void begin(const ContactSystem& system);

  // Continuation in the friction: coefficients times `fraction`, impulses as they are. At zero,
  // where the problem is convex, also the impulses begin at zero.
  void set_friction(ContactSystem& system, Scalar fraction) const;

  // Random impulses, about as large as the velocities ask for, the same in every run. With full
  // friction.
  void scatter(ContactSystem& system);

 private:
  std::vector<Scalar> friction_;
  std::minstd_rand random_;
  std::size_t starts_ = 0;
};

}  // namespace dyop::contact_internal
