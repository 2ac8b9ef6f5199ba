// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/impact_derivatives.h"

#include "dyop/core/error.h"

namespace dyop {
namespace {

PoseGradient scaled(const PoseGradient& gradient, Scalar factor) {
  return {factor * gradient.translation, factor * gradient.rotation};
}

// No point of the body is faster.
Scalar largest_speed(const Shape& shape, const Twist& twist) {
  return twist.v_WB.norm() + twist.w_WB.norm() * shape.bounding_radius();
}

}  // namespace

ImpactDerivatives impact_derivatives(const Shape& a, const Motion& X_WA, const Shape& b,
                                     const Motion& X_WB, const ToiResult& impact,
                                     const ImpactDerivativeOptions& options) {
  DYOP_REQUIRE(impact.status == ToiStatus::Impact,
               "impact_derivatives: the status must be Impact, ", "not ", name_of(impact.status));
  DYOP_REQUIRE(options.grazing_fraction >= 0 && options.grazing_fraction < 1,
               "impact_derivatives: grazing_fraction must be in [0, 1), not ",
               options.grazing_fraction);
  ImpactDerivatives result;
  result.distance =
      distance_derivatives(a, impact.X_WA, b, impact.X_WB, {.tolerance = options.tolerance});
  result.status = result.distance.status;
  if (result.status == DerivativeStatus::Touching) return result;
  const Twist twist_a = X_WA.twist(impact.t_safe);
  const Twist twist_b = X_WB.twist(impact.t_safe);
  const Scalar speed = largest_speed(a, twist_a) + largest_speed(b, twist_b);
  result.closing_speed =
      -(result.distance.by_a.along(twist_a) + result.distance.by_b.along(twist_b));
  if (!(result.closing_speed > options.grazing_fraction * speed)) {
    result.status = DerivativeStatus::Grazing;
    return result;
  }
  result.by_a = scaled(result.distance.by_a, 1 / result.closing_speed);
  result.by_b = scaled(result.distance.by_b, 1 / result.closing_speed);
  // That of the gradient, and that of the closing speed, a gradient along the relative motion.
  result.error = result.distance.error * (1 + speed / result.closing_speed);
  return result;
}

}  // namespace dyop
