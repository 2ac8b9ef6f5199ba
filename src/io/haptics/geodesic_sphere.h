// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "dyop/io/anatomy.h"

namespace dyop::io_internal {

/// The unit sphere as a finely divided icosahedron: at most six triangles meet at a vertex, and
/// none is a needle.
/// @param triangles The number wished for, >= 32; it has 20 f^2, for the f that comes nearest.
AnatomyMesh geodesic_sphere(std::size_t triangles);

}  // namespace dyop::io_internal
