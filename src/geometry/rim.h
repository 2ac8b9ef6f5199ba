// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/types.h"

namespace dyop::geometry_internal {

/// The point of a horizontal circle about the z axis that is farthest along a direction; the centre
/// if there is none. The part of the direction in the plane is divided by its larger coordinate, so
/// that nothing over- or underflows.
inline Vector3 rim_towards(const Vector3& direction, Scalar radius, Scalar height) {
  const Scalar size = std::max(std::abs(direction.x()), std::abs(direction.y()));
  if (!(size > 0)) return {0, 0, height};
  const Scalar x = direction.x() / size;
  const Scalar y = direction.y() / size;
  const Scalar scale = radius / std::sqrt(x * x + y * y);
  return {x * scale, y * scale, height};
}

/// The length of (x, y), rounded up: squares, sum and root err by less than 4u.
inline Scalar length_up(Scalar x, Scalar y) {
  const Scalar size = std::max(x, y);
  const Scalar a = x / size;
  const Scalar b = y / size;
  return size * std::sqrt(a * a + b * b) * (1 + 8 * kUnitRoundoff);
}

}  // namespace dyop::geometry_internal
