// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/solver/contact_system.h"

namespace dyop::contact_internal {

// Where more contacts carry a body than are needed, and what they ask of it differs by a little,
// some must let go. Multipliers then drift: every outer iteration shifts the same small amount of
// impulse from one contact to another, with hardly any effect on velocities, until one is at its
// bound; the smaller the contradiction, the more iterations that takes. This finds such a drift
// and goes to its end at once.
class ImpulseDrift {
 public:
  // Forgets earlier iterations.
  void clear();

  // To be told the impulses before an outer iteration and its penalty; those in the system are the
  // ones after it. If they go on changing like the last time, moves the system's impulses along
  // that change until the first of them that was inside its bounds reaches them. Returns whether it
  // did.
  bool follow(ContactSystem& system, const std::vector<Vector3>& before, Scalar penalty);

 private:
  bool is_steady(const std::vector<Block>& blocks, Scalar growth) const;

  std::vector<Vector3> previous_, change_;
  Scalar previous_penalty_ = 0;  // 0: there is no previous change
};

}  // namespace dyop::contact_internal
