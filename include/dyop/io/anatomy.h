// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Triangles of a made-up organ or instrument, in millimetres. Not taken from any body.
struct AnatomyMesh {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// A closed lumpy surface of about 160 x 110 x 70, like a liver, about the origin.
/// Its edges differ by a factor of 2.5 at most, and six triangles meet at nearly every vertex.
/// @param triangles The approximate number, >= 32: here the nearest 20 f^2; below a regular grid
///     determines it.
AnatomyMesh make_liver(std::size_t triangles);

/// A closed bent tube of radius 3, about 140 long, along x.
AnatomyMesh make_vessel(std::size_t triangles);

/// An open sheet of 240 x 240, domed by 40, like the inside of the abdominal wall; z upwards.
AnatomyMesh make_wall(std::size_t triangles);

/// A closed round rod along z from 0 to `length`.
AnatomyMesh make_shaft(std::size_t triangles, Scalar radius, Scalar length);

/// A closed tapered half of a grasper, from the origin along -z, its flat side towards +x.
AnatomyMesh make_jaw(std::size_t triangles, Scalar radius, Scalar length);

}  // namespace dyop
