#pragma once

#include <vector>

#include "dyop/distance/distance.h"

namespace dyop::internal {

/// The contacts at which the gap has a local minimum, in the same order.
///
/// A body that slides over a mesh is near the faces in front of it, too: at their edges, along
/// normals that lean back. Such a contact would stop the body though nothing is in its way. It is
/// told by a neighbour: a contact beside it with a smaller gap, whose faces hold its points.
/// @param contacts What find_contacts(a, X_WA, b, X_WB, reach) gives.
std::vector<Contact> local_contacts(const std::vector<Contact>& contacts, const Shape& a,
                                    const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                                    Scalar reach);

}  // namespace dyop::internal
