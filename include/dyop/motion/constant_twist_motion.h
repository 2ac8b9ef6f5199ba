// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/motion.h"
#include "dyop/motion/steady_turn.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
