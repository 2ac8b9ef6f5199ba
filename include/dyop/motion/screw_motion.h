// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

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
