// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "dyop/geometry/compound_shape.h"

namespace DYOP_EXPORT dyop {

/// A cube along the axes of a frame, such as an occupied leaf of an octree.
struct OccupiedCube {
  Vector3 center = Vector3::Zero();
  Scalar size = 1;  ///< length of an edge, > 0
};

/// Cubes as one shape: its children are boxes in their order.
/// @throws InvalidArgument if there is no cube, or one has no finite center or no positive size.
CompoundShape occupancy(std::span<const OccupiedCube> cubes);

/// All points within a radius of measured ones: balls of one radius, in their order. Points are
/// what a sensor saw, so the radius should be at least half of what lies between neighbours, or
/// thin things pass between them.
/// @throws InvalidArgument if there is no point, one is not finite, or the radius is not positive.
CompoundShape point_cloud(std::span<const Vector3> points, Scalar radius);

}  // namespace dyop
