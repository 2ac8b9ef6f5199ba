// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/shape.h"

#include <cmath>
#include <ostream>

#include "dyop/core/error.h"

namespace dyop {

std::string_view name_of(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::Vertex:
      return "Vertex";
    case FeatureKind::Edge:
      return "Edge";
    case FeatureKind::Face:
      return "Face";
    case FeatureKind::Smooth:
      return "Smooth";
  }
  return "Smooth";
}

std::ostream& operator<<(std::ostream& out, FeatureKind kind) {
  return out << name_of(kind);
}

MassProperties with_mass(const MassProperties& properties, Scalar mass) {
  DYOP_REQUIRE(std::isnormal(mass) && mass > 0, "mass must be > 0 and in the range of double, not ",
               mass);
  DYOP_REQUIRE(std::isfinite(properties.mass) && properties.mass > 0,
               "the mass to scale must be finite and > 0, not ", properties.mass);
  return {mass, properties.p_BoBcm, properties.I_BBcm * (mass / properties.mass)};
}

}  // namespace dyop
