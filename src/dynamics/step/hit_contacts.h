// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dynamics/body_record.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_point.h"
#include "dyop/core/types.h"
#include "dyop/toi/toi_result.h"

namespace dyop::dynamics_internal {

/// Two bodies at the poses from which a move was hit.
struct HitPair {
  const BodyRecord& a;
  RigidPose X_WA;
  const BodyRecord& b;
  RigidPose X_WB;
};

/// The contacts of a hit, moved back with its bodies: normals move with their faces, points on
/// rounded cores with the cores, those on smooth bodies with the centres of mass. Of two convex
/// shapes those that are nearer than `reach` at the hit and face the same way as it: a cylinder meets
/// an edge along a line, and would be turned by a push at one place of it.
std::vector<ContactPoint> contacts_of_hit(const ToiResult& hit, const HitPair& pair, Scalar reach,
                                          ContactWorkspace& workspace);

/// Where the impulse of such a contact acts on both bodies at the earlier poses, at which its two
/// points are not yet opposite each other: in the middle of the gap, and opposite the point that
/// slides over the other body's face, or the vertex. A ball would else be turned by a push along its
/// normal.
Vector3 acting_point(const ContactPoint& hit);

}  // namespace dyop::dynamics_internal
