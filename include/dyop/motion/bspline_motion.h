// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/sequence_motion.h"

namespace DYOP_EXPORT dyop {

/// A B-spline in position and rotation vector, R_WB = R_WC exp(theta(t)), as the Bezier curves of
/// its knot spans [Farin2002]. It is defined from knots[degree] to knots[control_points.size()];
/// inside, an inner knot of multiplicity m leaves degree - m derivatives continuous.
///
/// @param degree 1 to BezierMotion::kMaxDegree.
/// @param knots  control_points.size() + degree + 1 times in non-decreasing order; an inner knot
///               repeats at most `degree` times.
/// @throws InvalidArgument naming the value if one of these does not hold, a number is not finite
///         or R_WC is not a rotation.
SequenceMotion bspline_motion(std::size_t degree, std::span<const Scalar> knots,
                              const Matrix3& R_WC, std::span<const ControlPoint> control_points);

}  // namespace dyop
