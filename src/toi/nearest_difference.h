// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/geometry/shape.h"

namespace dyop::toi_internal {

// The differences b_j - a_i of the points of two elements: the corners of a triangle (vertex a,
// face b) or of a parallelogram (edges a and b; order b0-a0, b1-a0, b0-a1, b1-a1). The distance of
// the elements is the distance of the origin from it.
template <int N>
using Differences = std::array<Vector3, static_cast<std::size_t>(N)>;

// The point of a triangle or parallelogram nearest to the origin. Plain floating point: a proposal
// from which bounds are derived, never a bound itself.
template <int N>
struct NearestDifference {
  std::array<Scalar, static_cast<std::size_t>(N)> weights{};  // >= 0, of sum one
  Vector3 point = Vector3::Zero();
  // Towards the element, perpendicular to its feature; not of unit length; zero or inaccurate if
  // the feature degenerates.
  Vector3 normal = Vector3::Zero();
  Feature feature_a;
  Feature feature_b;
};

NearestDifference<3> find_nearest(const Differences<3>& corners);
NearestDifference<4> find_nearest(const Differences<4>& corners);

}  // namespace dyop::toi_internal
