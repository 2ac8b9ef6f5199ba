// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/contact/contact_problem.h"

namespace dyop::internal {

/// The impulses of a solved problem, one per contact, with the loads of bodies that slide on each
/// other shared as springs below all contacts would share them: normal impulses are an affine
/// function of place, as far as none becomes negative. Force and torque along the normal stay.
///
/// How four corners share the weight of a box is not determined. A solver begins with the loads of
/// the last step and leaves a little error along what is undetermined, so over many steps all load
/// drifts to two corners across, and friction, which depends on where the load is, with it. These
/// impulses are for the next solve to begin with. Contacts that stick keep their impulse along the
/// surface.
///
/// @param residual of the solve, length per time: contacts that open no faster are closed.
std::vector<Vector3> shared_loads(const ContactProblem& problem, Scalar residual);

}  // namespace dyop::internal
