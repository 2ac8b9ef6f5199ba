// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"

namespace dyop::dynamics_internal {

/// Contacts that push two overlapping bodies apart: an estimate, for a pair without a certificate.
///
/// A direction is guessed: the penetration of two convex shapes; of meshes the mean normal of the
/// faces that cross, if there are closed meshes; else the axis along which the bodies' boxes overlap
/// least. B is taken out along it until `gap` is free, the contacts there are found, and carried
/// back, so that they have negative gaps. Empty if that does not work out.
std::vector<ContactPoint> estimate_overlap(const BodyRecord& a, const RigidPose& X_WA,
                                           const BodyRecord& b, const RigidPose& X_WB, Scalar gap,
                                           ContactWorkspace& workspace);

}  // namespace dyop::dynamics_internal
