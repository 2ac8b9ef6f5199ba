// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/motion.h"

namespace dyop::motion_internal {
template <std::size_t kMaxDegree>
class ChartCurve;
}

namespace DYOP_EXPORT dyop {

/// Control point of a curve in position and rotation vector, R_WB = R_WC exp(theta), C a fixed
/// frame.
struct ControlPoint {
  Vector3 p_WB = Vector3::Zero();   ///< position of the body's origin
  Vector3 theta = Vector3::Zero();  ///< rotation vector relative to R_WC, radians, any size
};

/// The position is a Bezier curve, the rotation R_WC exp(theta(t)) with theta a Bezier curve
/// [Farin2002]. The body is at the first control point at the start and at the last one at the end.
/// Bounds: docs/algorithms/motions.md.
class BezierMotion final : public Motion {
 public:
  static constexpr std::size_t kMaxDegree = 9;

  /// `control_points`: 2 to kMaxDegree + 1 of them, one more than the degree; copied.
  /// @throws InvalidArgument if the interval has no length or is not finite, the count is out
  ///         of range, a number is not finite, or R_WC is not a rotation.
  BezierMotion(const TimeInterval& interval, const Matrix3& R_WC,
               std::span<const ControlPoint> control_points);
  /// The same with the rotation of X_WC, used unchanged: with what the two members below return it
  /// reproduces the motion exactly.
  BezierMotion(const TimeInterval& interval, const RigidPose& X_WC,
               std::span<const ControlPoint> control_points);
  RigidPose X_WC() const;
  std::span<const ControlPoint> control_points() const { return {control_points_.data(), count_}; }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override;
  bool is_trusted() const override { return true; }

 private:
  std::size_t count_;
  std::array<ControlPoint, kMaxDegree + 1> control_points_;
  std::shared_ptr<const motion_internal::ChartCurve<kMaxDegree>> curve_;
};

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
