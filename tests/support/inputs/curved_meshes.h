// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "support/inputs/mesh_generators.h"

namespace dyop::testing {

/// Prism over a convex polygon in the plane y = 0, given counterclockwise as seen from -y (x to the
/// right, z up), from y = -half_width to half_width. Closed.
MeshArrays prism(const std::vector<Vector3>& polygon, Scalar half_width);

/// Round disc about the y axis, its rim a regular polygon. Closed.
MeshArrays disc(Scalar radius, Scalar half_width, int facets);

/// The lower half of a disc about the y axis, its arc of `facets` sides; the origin is the middle
/// of the circle. Closed.
MeshArrays half_disc(Scalar radius, Scalar half_width, int facets);

/// Points whose convex hull is an oloid: `facets` on each of two circles of this radius, one in the
/// plane z = 0 about (-radius/2, 0, 0), one in the plane y = 0 about (radius/2, 0, 0).
std::vector<Vector3> oloid_points(Scalar radius, int facets);

/// Trough along y, the inside of a cylinder about the y axis: `facets` strips over the angles
/// -span..span from straight below. Open.
MeshArrays trough(Scalar radius, Scalar half_width, Scalar span, int facets);

/// Spherical bowl about the origin, the part within `span` of straight below. Open.
MeshArrays bowl(Scalar radius, Scalar span, int rings);

}  // namespace dyop::testing
