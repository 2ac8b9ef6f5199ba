#pragma once

#include <array>

#include "dyop/motion/motion.h"

namespace dyop {

/// One end of a cubic in the chart R_WB = R_WC exp(theta), C a fixed frame.
struct HermiteNode {
  Vector3 p_WB = Vector3::Zero();        ///< position of the body's origin
  Vector3 v_WB = Vector3::Zero();        ///< its velocity
  Vector3 theta = Vector3::Zero();       ///< rotation vector relative to the chart's R_WC, radians
  Vector3 theta_rate = Vector3::Zero();  ///< d theta / dt; equal to R_CW w_WB only at theta = 0
};

/// Dense output of an integrator: the position is a cubic Hermite polynomial, the rotation is
/// R_WC exp(theta(t)) with theta a cubic Hermite polynomial.
///
/// Bounds over a part of the domain come from the Bernstein coefficients over that part:
/// |w| <= |theta'| and |w'| <= |theta''| + |theta'| min(|theta x theta'| / 6, |theta'| / pi).
/// They converge to the true suprema as the part shrinks where theta = 0 or the axis is fixed.
/// Cost of a bound: about 300 multiplications, no allocation. See docs/algorithms/motions.md.
class HermiteMotion final : public Motion {
 public:
  struct State {
    RigidPose X_WB;
    Twist twist_WB;
  };

  /// Through two states; the body turns by less than pi from the first to the second: theta(end)
  /// is the shortest rotation vector of R_BeginEnd.
  /// @throws InvalidArgument if the interval has no length or a number is not finite.
  HermiteMotion(const TimeInterval& interval, const State& begin, const State& end);

  /// From data in a chart, as an integrator of theta has them. Usually begin.theta = 0; any turn.
  /// @throws InvalidArgument as the constructor; R_WC must be a rotation.
  static HermiteMotion from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                  const HermiteNode& begin, const HermiteNode& end);
  /// The same with the rotation of X_WC, taken as it is; from the three below the same motion again.
  static HermiteMotion from_chart(const TimeInterval& interval, const RigidPose& X_WC,
                                  const HermiteNode& begin, const HermiteNode& end);
  RigidPose X_WC() const { return RigidPose::from_trusted(R_WC_, Vector3::Zero()); }
  const HermiteNode& begin() const { return begin_; }
  const HermiteNode& end() const { return end_; }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return interval_; }

 private:
  HermiteMotion(const TimeInterval& interval, const RigidPose& X_WC);
  void set_nodes(const HermiteNode& begin, const HermiteNode& end);
  Scalar parameter(Scalar t) const { return (t - interval_.begin) / interval_.length(); }

  // One cubic with its derivatives in time, as Bernstein coefficients over the domain.
  struct Cubic {
    std::array<Vector3, 4> value;
    std::array<Vector3, 3> rate;
    std::array<Vector3, 2> acceleration;
    Scalar value_noise;  // rounding allowances of values, rates and accelerations on any part
    Scalar rate_noise;
    Scalar acceleration_noise;
  };
  static Cubic make_cubic(const std::array<Vector3, 4>& value, Scalar duration);

  TimeInterval interval_;
  Matrix3 R_WC_;
  HermiteNode begin_;
  HermiteNode end_;
  // Relative to the position at the begin, so that derivatives far from the world's origin are exact
  // differences.
  Cubic displacement_;
  Cubic theta_;
};

}  // namespace dyop
