// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "dyop/motion/motion.h"

namespace dyop::motion_internal {
template <std::size_t kMaxDegree>
class ChartCurve;
}

namespace DYOP_EXPORT dyop {

/// One end of a cubic in the chart R_WB = R_WC exp(theta), C a fixed frame.
struct HermiteNode {
  Vector3 p_WB = Vector3::Zero();        ///< position of the body's origin
  Vector3 v_WB = Vector3::Zero();        ///< its velocity
  Vector3 theta = Vector3::Zero();       ///< rotation vector relative to the chart's R_WC, radians
  Vector3 theta_rate = Vector3::Zero();  ///< d theta / dt; equal to R_CW w_WB only at theta = 0
};

/// Dense output of an integrator: the position is a cubic Hermite polynomial, the rotation is
/// R_WC exp(theta(t)) with theta a cubic Hermite polynomial. Bounds: docs/algorithms/motions.md.
class HermiteMotion final : public Motion {
 public:
  /// Through two states. The body turns by less than pi from the first to the second: theta(end) is
  /// the shortest rotation vector of R_BeginEnd.
  /// @throws InvalidArgument if the interval has no length or a number is not finite.
  HermiteMotion(const TimeInterval& interval, const MotionState& begin, const MotionState& end);

  /// From data in a chart, as an integrator of theta provides it. Usually begin.theta = 0; any
  /// turn.
  /// @throws InvalidArgument as the constructor; R_WC must be a rotation.
  static HermiteMotion from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                  const HermiteNode& begin, const HermiteNode& end);
  /// The same with the rotation of X_WC, used unchanged: with what the three members below return
  /// it reproduces the motion exactly.
  static HermiteMotion from_chart(const TimeInterval& interval, const RigidPose& X_WC,
                                  const HermiteNode& begin, const HermiteNode& end);
  RigidPose X_WC() const;
  const HermiteNode& begin() const { return begin_; }
  const HermiteNode& end() const { return end_; }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override;
  bool is_trusted() const override { return true; }

 private:
  HermiteMotion(const TimeInterval& interval, const RigidPose& X_WC, const HermiteNode& begin,
                const HermiteNode& end);

  HermiteNode begin_;
  HermiteNode end_;
  std::shared_ptr<const motion_internal::ChartCurve<3>> curve_;
};

}  // namespace dyop
