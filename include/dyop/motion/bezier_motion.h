#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "dyop/motion/motion.h"

namespace dyop {

/// Control point of a curve in position and rotation vector, R_WB = R_WC exp(theta), C a fixed
/// frame.
struct ControlPoint {
  Vector3 p_WB = Vector3::Zero();   ///< position of the body's origin
  Vector3 theta = Vector3::Zero();  ///< rotation vector relative to R_WC, radians, any size
};

/// The position is a Bezier curve, the rotation R_WC exp(theta(t)) with theta a Bezier curve
/// [Farin2002]. The body is at the first control point at the begin and at the last one at the end.
///
/// Bounds over a part of the domain come from the control points of that part, as for
/// HermiteMotion; they cost O(degree^3). No allocation. See docs/algorithms/motions.md.
class BezierMotion final : public Motion {
 public:
  static constexpr std::size_t kMaxDegree = 9;

  /// `control_points`: 2 to kMaxDegree + 1 of them, one more than the degree; copied.
  /// @throws InvalidArgument if the interval has no length or is not finite, the count is another
  ///         one, a number is not finite, or R_WC is no rotation.
  BezierMotion(const TimeInterval& interval, const Matrix3& R_WC,
               std::span<const ControlPoint> control_points);
  /// The same with the rotation of X_WC, taken as it is; from the two below the same motion again.
  BezierMotion(const TimeInterval& interval, const RigidPose& X_WC,
               std::span<const ControlPoint> control_points);
  RigidPose X_WC() const { return RigidPose::from_trusted(R_WC_, Vector3::Zero()); }
  std::span<const ControlPoint> control_points() const {
    return {control_points_.data(), degree_ + 1};
  }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return interval_; }

 private:
  using Coefficients = std::array<Vector3, kMaxDegree + 1>;

  // One curve with its derivatives in time, as Bernstein coefficients over the domain.
  struct Curve {
    Coefficients value;         // degree_ + 1 of them
    Coefficients rate;          // degree_
    Coefficients acceleration;  // degree_ - 1
    Scalar value_noise;  // rounding allowances of values, rates and accelerations on any part
    Scalar rate_noise;
    Scalar acceleration_noise;
  };

  Curve make_curve(const Coefficients& value) const;
  Scalar parameter(Scalar t) const { return (t - interval_.begin) / interval_.length(); }

  TimeInterval interval_;
  Matrix3 R_WC_;
  std::size_t degree_;
  std::array<ControlPoint, kMaxDegree + 1> control_points_;
  // Relative to the position at the begin, so that derivatives far from the world's origin are exact
  // differences.
  Curve displacement_;
  Curve theta_;
};

}  // namespace dyop
