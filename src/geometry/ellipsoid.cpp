// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/ellipsoid.h"

#include <cmath>
#include <numbers>

#include "geometry/solid.h"

namespace dyop {

Ellipsoid::Ellipsoid(const Vector3& semi_axes) : semi_axes_(semi_axes) {
  for (int k = 0; k < 3; ++k) {
    geometry_internal::require_length("semi-axis of an ellipsoid", semi_axes[k]);
  }
}

// The image of a unit ball: its farthest point along d is that of the ball along A d, mapped by A.
SupportPoint Ellipsoid::core_support(const Vector3& direction) const {
  const Vector3 mapped = semi_axes_.cwiseProduct(direction / semi_axes_.maxCoeff());
  // Divided by its largest part, so that nothing over- or underflows.
  const Scalar size = mapped.cwiseAbs().maxCoeff();
  if (!(size > 0)) return {Vector3(0, 0, semi_axes_.z()), std::nullopt};
  return {semi_axes_.cwiseProduct((mapped / size).normalized()), std::nullopt};
}

MassProperties Ellipsoid::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  const Vector3 sq = semi_axes_.cwiseAbs2();
  MassProperties properties;
  properties.mass = density * (4 * std::numbers::pi / 3) * semi_axes_.prod();
  const Vector3 moments(sq.y() + sq.z(), sq.z() + sq.x(), sq.x() + sq.y());
  properties.I_BBcm = (moments * (properties.mass / 5)).asDiagonal();
  return geometry_internal::require_representable(properties);
}

}  // namespace dyop
