#pragma once

#include "dyop/hierarchy/mesh_hierarchy.h"

namespace dyop::internal {

// The unit direction from a to b along which the slabs of the two boxes are farthest apart, of the
// sixteen of the separating axis test and the line of centers [Gottschalk1996], and the way between
// the faces of a that face b: exact for boxes with the same axes. Some unit vector if none
// separates. Only proposes: a caller evaluates the gap itself. Both boxes in one frame.
Vector3 separating_direction(const OrientedBox& a, const OrientedBox& b);

}  // namespace dyop::internal
