// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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
