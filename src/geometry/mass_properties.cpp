// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/mass_properties.h"

#include <cmath>

#include "dyop/core/error.h"

namespace dyop {

MassProperties with_mass(const MassProperties& properties, Scalar mass) {
  DYOP_REQUIRE(std::isnormal(mass) && mass > 0, "mass must be > 0 and in the range of double, not ",
               mass);
  DYOP_REQUIRE(std::isfinite(properties.mass) && properties.mass > 0,
               "the mass to scale must be finite and > 0, not ", properties.mass);
  return {mass, properties.p_BoBcm, properties.I_BBcm * (mass / properties.mass)};
}

}  // namespace dyop
