// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dyop/geometry/compound_shape.h"
#include "geometry/compound_tree.h"

namespace dyop::geometry_internal {

/// A child of a compound, as a mesh or convex shape in the compound's frame; another shape itself.
inline const Shape& shape_part(const Shape& shape, std::int32_t child) {
  if (shape.kind() != ShapeKind::Compound) return shape;
  return static_cast<const CompoundShape&>(shape).tree().part(child).shape();
}

}  // namespace dyop::geometry_internal
