// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/core/types.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// A rotation at constant angular velocity, R(tau) = exp(tau [w]) R0, by Rodrigues' formula with
/// everything precomputed but one sine and one cosine: R(tau) = S + cos(|w| tau) P + sin(|w| tau)
/// Q. Orthonormal and exact to a few roundings of the angle |w| tau.
class SteadyTurn {
 public:
  SteadyTurn() = default;

  /// @param R0 Rotation at tau = 0.
  /// @param w  Angular velocity, radians per time, in the frame that R0 maps into, of any finite
  ///           length.
  SteadyTurn(const Matrix3& R0, const Vector3& w) : rate_(w.stableNorm()), fixed_(R0) {
    if (!(rate_ > 0)) return;
    const Vector3 axis = (w / rate_).normalized();
    fixed_ = axis * (axis.transpose() * R0);
    cosine_part_ = R0 - fixed_;
    for (int k = 0; k < 3; ++k) sine_part_.col(k) = axis.cross(R0.col(k));
  }

  Matrix3 at(Scalar tau) const {
    if (rate_ == 0) return fixed_;
    const Scalar angle = rate_ * tau;
    return fixed_ + std::cos(angle) * cosine_part_ + std::sin(angle) * sine_part_;
  }

 private:
  Scalar rate_ = 0;
  Matrix3 fixed_ = Matrix3::Identity();
  Matrix3 cosine_part_ = Matrix3::Zero();
  Matrix3 sine_part_ = Matrix3::Zero();
};

/// A body that does not move. Defined at all times; all bounds are zero.
class RestMotion final : public Motion {
 public:
  /// At the world's origin.
  RestMotion() = default;

  explicit RestMotion(const RigidPose& X_WB) : X_WB_(X_WB) {}

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  bool is_trusted() const override { return true; }

 private:
  RigidPose X_WB_;
};

/// The body's origin moves on a straight line while the body turns about it, both at a constant
/// rate: p(t) = p0 + (t - t0) v, R(t) = exp((t - t0) w) R0. Defined at all times.
///
/// Both accelerations are zero, so the bounds are equalities (rounded up).
class ConstantTwistMotion final : public Motion {
 public:
  /// @param X_WB0    Pose at time t0.
  /// @param twist_WB v of the body's origin and w, both in world, constant.
  /// @param t0       Reference time.
  /// @throws InvalidArgument if a number is not finite.
  ConstantTwistMotion(const RigidPose& X_WB0, const Twist& twist_WB, Scalar t0 = 0);

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  bool is_trusted() const override { return true; }

  /// How the pose at time t changes, as a twist, if X_WB0 and the twist of the motion change:
  /// each of `initial` and `rate` is a change per unit of some parameter, of X_WB0 (v: of the
  /// origin, w: a turn about it) and of twist_WB. All in world. For derivatives of distances and
  /// times of impact.
  Twist pose_change(Scalar t, const Twist& initial, const Twist& rate) const;

  /// As given.
  const RigidPose& X_WB0() const { return X_WB0_; }
  Scalar t0() const { return t0_; }

 private:
  SteadyTurn R_WB_;
  RigidPose X_WB0_;
  Twist twist_WB_;
  TwistBound bound_;
  Scalar t0_;
};

/// A constant screw: the body turns about a fixed line of the world and slides along it, as a drill
/// or a door does. Defined at all times.
///
/// |v| and |v'| are constant: sqrt(slide^2 + turn^2 rho^2) and turn^2 rho, with rho the distance of
/// the body's origin from the line; the angular acceleration is zero. The bounds are equalities
/// (rounded up).
class ScrewMotion final : public Motion {
 public:
  struct Screw {
    Vector3 p_WA = Vector3::Zero();     ///< a point of the axis
    Vector3 axis_W = Vector3::UnitZ();  ///< direction of the axis, any length but zero
    Scalar turn_rate = 0;               ///< radians per time, right-handed about axis_W
    Scalar slide_rate = 0;              ///< length per time along axis_W; pitch * turn_rate
  };

  /// @param X_WB0 Pose at time t0.
  /// @throws InvalidArgument if a number is not finite or the axis is zero.
  ScrewMotion(const RigidPose& X_WB0, const Screw& screw, Scalar t0 = 0);

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  bool is_trusted() const override { return true; }

  /// As given.
  const RigidPose& X_WB0() const { return X_WB0_; }
  const Screw& screw() const { return screw_; }
  Scalar t0() const { return t0_; }

 private:
  Vector3 arm(Scalar tau) const;  // from the axis to the body's origin, perpendicular to the axis

  RigidPose X_WB0_;
  Screw screw_;
  Vector3 axis_W_;  // unit
  Vector3 p_WF0_;   // foot of the perpendicular from the body's origin on the axis, at t0
  Vector3 arm0_W_;
  Scalar t0_;
  TwistBound bound_;
};

}  // namespace dyop
