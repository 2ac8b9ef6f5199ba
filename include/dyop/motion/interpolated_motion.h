// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// How a body turns between two orientations.
enum class RotationPath {
  /// Constant angular velocity along the shortest arc, R0 exp(s theta): spherical linear
  /// interpolation [Shoemake1985].
  Slerp,
  /// The rotation vector relative to the world is interpolated linearly, exp((1-s) r0 + s r1), as
  /// in Rigid-IPC [Ferguson2021]. Depends on the choice of the world frame; w is not constant.
  RotationVector,
};

/// Between two poses: the origin moves linearly, the rotation along a RotationPath.
///
/// Internally R_WC exp(theta0 + (t - t0) theta'), with |w| <= |theta'| and
/// |w'| <= |theta'| min(|theta0 x theta'| / 6, |theta'| / pi), zero for Slerp.
class InterpolatedMotion final : public Motion {
 public:
  /// An end of a path of rotation vectors relative to a frame C.
  struct Node {
    Vector3 p_WB = Vector3::Zero();
    Vector3 theta = Vector3::Zero();  ///< R_WB = R_WC exp(theta), radians, any size
  };

  /// Uses the shortest rotation vectors; for a turn of pi, one of the two.
  /// @throws InvalidArgument if the interval has no length or is not finite.
  InterpolatedMotion(const TimeInterval& interval, const RigidPose& X_WB0, const RigidPose& X_WB1,
                     RotationPath path = RotationPath::Slerp);

  /// Linear in the rotation vector relative to R_WC, also by more than half a turn. If R_WC is the
  /// rotation at the start and begin.theta = 0, the angular velocity is constant.
  /// @throws InvalidArgument as the constructor, or if a number is not finite.
  static InterpolatedMotion from_chart(const TimeInterval& interval, const Matrix3& R_WC,
                                       const Node& begin, const Node& end);
  /// The same with the rotation of X_WC, used unchanged: with what the three members below return
  /// it reproduces the motion exactly.
  static InterpolatedMotion from_chart(const TimeInterval& interval, const RigidPose& X_WC,
                                       const Node& begin, const Node& end);
  RigidPose X_WC() const { return RigidPose::from_trusted(R_WC_, Vector3::Zero()); }
  const Node& begin() const { return begin_; }
  const Node& end() const { return end_; }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return interval_; }
  bool is_trusted() const override { return true; }

 private:
  struct Chart {
    Matrix3 R_WC;
    Node begin;
    Node end;
  };
  InterpolatedMotion(const TimeInterval& interval, const Chart& chart);
  static Chart make_chart(const RigidPose& X_WB0, const RigidPose& X_WB1, RotationPath path);

  TimeInterval interval_;
  Matrix3 R_WC_;
  Node begin_;
  Node end_;
  Vector3 v_WB_;
  Vector3 theta_rate_;
  TwistBound bound_;
};

}  // namespace dyop

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
