// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/shape.h"

namespace dyop::geometry_internal {

inline void require_density(Scalar density) {
  DYOP_REQUIRE(std::isfinite(density) && density > 0, "density must be finite and > 0, not ",
               density);
}

inline void require_length(const char* what, Scalar length) {
  DYOP_REQUIRE(length > 0 && length <= kLargestCoordinate, what, " must be > 0 and at most ",
               kLargestCoordinate, ", not ", length);
}

// Returns mass properties whose mass neither overflowed nor underflowed, so that it can divide.
inline MassProperties require_representable(const MassProperties& properties) {
  DYOP_REQUIRE(std::isnormal(properties.mass) && properties.mass > 0 &&
                   properties.I_BBcm.allFinite() && properties.p_BoBcm.allFinite(),
               "mass properties are out of the range of double: mass ", properties.mass);
  return properties;
}

}  // namespace dyop::geometry_internal
