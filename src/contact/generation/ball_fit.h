// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/contact/contact_point.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"

namespace dyop::contact_internal {

/// Contacts of a ball, or of a rounded corner, on a finely faceted mesh: moves them to where the
/// smooth surface comes nearest whose normals at the mesh's vertices are those of a sphere through
/// the neighbours ([Max1999]), in between linear. A facet's own normal is off by up to half the angle
/// to the next one, at random from step to step as the ball rolls.
///
/// Left alone: contacts on facets that leave that surface by more than `most_sagitta`, a length, at
/// a border, or with a vertex whose triangles turn too much. 0: all are. Returns whether any moved.
DYOP_EXPORT bool fit_ball_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                   const RigidPose& X_WB, Scalar most_sagitta,
                                   std::vector<ContactPoint>& contacts);

}  // namespace dyop::contact_internal
