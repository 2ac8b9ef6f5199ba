// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "dyop/geometry/shape.h"

namespace dyop::geometry_internal {

/// The bounding radius, but at most half the diagonal of the bounding box: no larger where the
/// frame's origin is far from the shape. Length.
inline Scalar shape_size(const Shape& shape) {
  return std::min(shape.bounding_radius(), shape.bounding_box().diagonal().norm() / 2);
}

}  // namespace dyop::geometry_internal
