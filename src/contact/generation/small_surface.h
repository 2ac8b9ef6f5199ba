// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact/generation/contact_search.h"

namespace dyop::contact_internal {

/// Whether the query is of a mesh and a convex shape with so few triangles, such as a box, that to
/// go through them all costs less than to open boxes around them.
bool has_small_surface(const ContactQuery& query);

/// Of the query's first pairs, which begin at the convex shape's root, those pairs of triangles
/// that may be in contact: bounds along the axes of the convex shape, and the sides of the mesh's
/// triangle, leave out most of the others.
/// @pre has_small_surface(query); the mesh's boxes are leaves.
void split_small_surface(const ContactQuery& query, BoxPairStack& pairs);

}  // namespace dyop::contact_internal
