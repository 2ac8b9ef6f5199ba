// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dyop/contact/contact_problem.h"
#include "dyop/core/export.h"

namespace dyop::dynamics_internal {

/// Impulses that prove a problem infeasible, of any unit.
struct SelfStress {
  std::vector<Vector3> impulses_W;          ///< on B, by contact
  std::vector<Vector3> angular_impulses_W;  ///< of rolling and torsional friction, likewise
  std::vector<Scalar> row_impulses;         ///< by row
  std::size_t hardest_contact = 0;          ///< takes most of the work from a prescribed motion
};

/// Looks for impulses in the friction cones of the contacts, rolling and torsional friction
/// included, and of rigid rows of joints, that balance on each of the first `movable` bodies and
/// take work from prescribed motions of the others. With them a problem is proven infeasible:
/// friction locks itself, however large the impulses, and no velocity of the bodies has u . n -
/// target >= friction |sliding velocity| + rolling |rolling rate| + torsional |spin| at all
/// contacts: by Farkas' lemma exactly one of the two exists. Where such a velocity exists, so does
/// a solution of Coulomb's law ([Acary2011]).
///
/// An ellipse counts with its smaller coefficient and a friction law as none, so what is found is
/// true of them too. Springs and motors, which give way, take no part.
///
/// @param imbalance  What may be left of force or torque on a body, over its lever arm, as a part
///   of the work over the speed of the prescribed motion; at least 1e-5, which counts as a proof.
///   Impulses that balance up to 1e-3, say, would lock with that much more friction, or with
/// contacts at places that much apart; solutions ask for impulses so much larger than what they
/// accelerate.
/// @return None if there are no such impulses, or if such balance was not reached in a hundred
///   iterations, or for more than 200 bodies.
/// Cost: a least-squares problem of 6 `movable` rows per iteration.
DYOP_EXPORT std::optional<SelfStress> find_self_stress(const ContactProblem& problem,
                                                       std::size_t movable, Scalar imbalance = 0);

}  // namespace dyop::dynamics_internal
