// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"

namespace DYOP_EXPORT dyop {

/// The result of published_dyop() with its intermediate steps, in the frame of the arguments:
/// enough to draw the construction of [DyOP].
template <int dimension>
struct PublishedDyop {
  using Point = Eigen::Matrix<Scalar, dimension, 1>;
  using Box = Eigen::AlignedBox<Scalar, dimension>;

  Box box_a;  ///< axis-aligned box of a
  Box box_b;
  /// Axis of movement: the axis along which the boxes are farthest apart, or overlap the least.
  int axis = 0;
  Box internal_box;                 ///< between the facing extremes of the two boxes
  Point pivot = Point::Zero();      ///< the dynamic origin point, its middle
  std::array<int, 2> kept_a{0, 1};  ///< vertex numbers of the two vertices the pivot keeps
  std::array<int, 2> kept_b{0, 1};
  Point p_a = Point::Zero();  ///< end on a of the shortest segment found
  Point p_b = Point::Zero();  ///< end on b
  Feature feature_a;          ///< the vertex or the kept edge that p_a is on
  Feature feature_b;
  Scalar distance = 0;  ///< |p_b - p_a|
};

/// DyOP as published [DyOP], for comparison: not a distance one can rely on.
///
/// Returns the distance of two edges, one of each triangle, that the pivot chose. Up to rounding it
/// is never below the distance of the triangles, and in general above it; intersection is not
/// detected, except for crossing edges in the plane. docs/algorithms/published_dyop.md tells how
/// often it errs and by how much; triangle_distance() is the algorithm to use.
///
/// Coordinates must be finite and at most kLargestCoordinate; they are not checked here.
PublishedDyop<2> published_dyop(const PlanarTriangle& a, const PlanarTriangle& b);

/// The direct extension to three dimensions: one more coordinate in every step.
PublishedDyop<3> published_dyop(const Triangle& a, const Triangle& b);

}  // namespace dyop
