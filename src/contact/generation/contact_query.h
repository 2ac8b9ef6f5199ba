// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "contact/generation/contact_search.h"

namespace dyop::contact_internal {

/// The input of a search for one pair of pieces at two poses, from the roots of their trees.
/// @param reach As for generate_contacts().
ContactQuery contact_query(const ContactSurface& surface_a, const Shape& a, const RigidPose& X_WA,
                           const ContactSurface& surface_b, const Shape& b, const RigidPose& X_WB,
                           Scalar reach, const ContactGeneratorOptions& options);

/// How far apart two findings of one contact may be when it is `distance` from the other shape.
Scalar spread_of_doubles(const ContactQuery& query, Scalar distance);

/// Puts all pairs of leaves within reach into the workspace's `first_pairs`. Returns false if it has
/// no list of neighbours that covers that.
bool list_neighbours(ContactWorkspace& workspace, const Shape& a, const RigidPose& X_WA,
                     const Shape& b, const RigidPose& X_WB, Scalar reach);

/// Appends what was found as contacts, in the order of their keys: once each, in world, and only in
/// the query's region.
void finish_contacts(const ContactQuery& query, const RigidPose& X_WA,
                     std::vector<FoundContact>& found, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, std::int32_t piece_a = 0,
                     std::int32_t piece_b = 0);

}  // namespace dyop::contact_internal
