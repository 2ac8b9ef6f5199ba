// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/triangle.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Result of textbook_gjk(), in the frame of the arguments. An estimate: nothing is proven.
template <int dimension>
struct GjkEstimate {
  using Point = Eigen::Matrix<Scalar, dimension, 1>;

  Scalar distance = 0;
  Point p_a = Point::Zero();
  Point p_b = Point::Zero();
  bool is_overlapping = false;  ///< the simplex holds the origin, up to rounding
  int iterations = 0;
};

/// Distance of two triangles by the algorithm of [GilbertJohnsonKeerthi1988] as textbooks present
/// it ([vandenBergen2003] chapter 4, with the region tests of [Ericson2005] chapter 5), without a
/// certificate and without care for slivers: the rival in the experiment of [DyOP]. gjk_distance()
/// is the one to use.
///
/// Coordinates must be finite; they are not checked here. Bounded, no allocation.
GjkEstimate<2> textbook_gjk(const PlanarTriangle& a, const PlanarTriangle& b);
GjkEstimate<3> textbook_gjk(const Triangle& a, const Triangle& b);

}  // namespace dyop
