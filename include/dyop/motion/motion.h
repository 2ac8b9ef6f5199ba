// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/time_interval.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// Velocity of a body B in world W: of the body's origin, and angular, both expressed in W.
struct Twist {
  Vector3 v_WB = Vector3::Zero();  ///< length per time
  Vector3 w_WB = Vector3::Zero();  ///< radians per time
};

/// Upper bounds that hold at every time of an interval (for accelerations: almost everywhere).
/// Infinity is allowed: it costs speed, never safety.
struct TwistBound {
  Scalar linear_speed = 0;          ///< sup |v_WB|, length per time
  Scalar angular_speed = 0;         ///< sup |w_WB|, radians per time
  Scalar linear_acceleration = 0;   ///< sup |dv_WB/dt|; infinite if v jumps in the interval
  Scalar angular_acceleration = 0;  ///< sup |dw_WB/dt|; infinite if w jumps in the interval
};

/// Scale of the rounding of poses: the computed pose maps a point at a distance r from the body's
/// origin to within kPoseNoise * (length + angle * r) of its exact position.
struct PoseScale {
  Scalar length = 0;  ///< largest length from which positions are computed
  Scalar angle = 1;   ///< 1 plus the angles from which rotations are computed, radians
};

/// How a motion goes on from a time t to a later time `end`, whatever its twist does in between. It
/// stays near a motion with a Lipschitz twist that has the same pose at t: the origins are never
/// farther apart than linear_deviation, and points at a distance r from the origin are turned away
/// by at most angular_deviation * r more. Bounds are rounded up; rounding of poses comes on top.
struct MotionStretch {
  Scalar end = 0;
  Twist twist = {};                ///< of the motion nearby, at t
  Scalar linear_acceleration = 0;  ///< bounds on how its twist changes on [t, end]
  Scalar angular_acceleration = 0;
  Scalar linear_deviation = 0;   ///< length
  Scalar angular_deviation = 0;  ///< at most 2
};

/// Pose and velocity of a body at one time.
struct MotionState {
  RigidPose X_WB = {};
  Twist twist = {};
};

/// A pose as a function of time, with rigorous bounds on how its twist changes. This is all that
/// the impact engine knows about dynamics.
///
/// Motions are immutable, and all members may be called from several threads at once.
///
/// To add a motion:
///   1. `include/dyop/motion/<name>_motion.h` and `src/motion/<name>_motion.cpp`, deriving from
///      Motion; list both in `src/motion/CMakeLists.txt`;
///   2. one word in `tests/motion/all_motions.h`: the contract test checks pose, twist and every
///      bound against dense sampling.
class Motion {
 public:
  virtual ~Motion() = default;

  /// Pose X_WB of the body at time t, within domain(). The value must be within rounding of the
  /// exact function, see pose_scale().
  virtual RigidPose pose(Scalar t) const = 0;

  /// Twist at time t, the derivative of pose; at a jump the value from the right.
  virtual Twist twist(Scalar t) const = 0;

  /// Pose and twist at time t together, the same bits as from pose() and twist(). Override it where
  /// they share work: the impact engine only calls this.
  virtual MotionState state(Scalar t) const { return {pose(t), twist(t)}; }

  /// Bounds over `interval`, a sub-interval of domain(). Must round up, never down. A jump of the
  /// twist at interval.end itself does not count: there the bounds hold for the values from the
  /// left. So the bounds over [t, smooth_until(t)] have finite accelerations.
  virtual TwistBound twist_bound(const TimeInterval& interval) const = 0;

  /// Scale of the rounding of poses over `interval`, a sub-interval of domain().
  /// Default: for a motion whose poses are computed from the time and from lengths no larger than
  /// the position and the distance travelled. Override it where they are computed from something
  /// larger, such as the time since a distant reference time.
  virtual PoseScale pose_scale(const TimeInterval& interval) const;

  /// Where the motion is defined. Default: always.
  virtual TimeInterval domain() const { return {-kInfinity, kInfinity}; }

  /// The end of the piece from t on in which the twist is Lipschitz: a time > t, at which v or w
  /// may jump. Default: the end of domain(), or infinity beyond it.
  virtual Scalar smooth_until(Scalar t) const {
    const Scalar end = domain().end;
    return t < end ? end : kInfinity;
  }

  /// A stretch that starts at t and ends after `after`, a time >= smooth_until(t): the shortest one
  /// that is known, since longer ones deviate more. With it a query passes many jumps of the twist
  /// at once, where they make no difference. Default: none, which costs speed, never safety.
  virtual std::optional<MotionStretch> stretch(Scalar t, Scalar after) const;

  /// True if poses are rotations and bounds hold by construction: queries then check only that
  /// poses and twists are finite. The library's own motions say so. Leave it as it is for a motion
  /// that nobody has proven: queries refuse poses that are no rotations, and jumps.
  virtual bool is_trusted() const { return false; }
};

/// Throws InvalidArgument unless `motion` is defined on all of `interval`.
void require_defined(const Motion& motion, const TimeInterval& interval, const char* what);

/// @throws InvalidArgument if a bound for `interval` is negative or NaN; the message names `what`.
void require_valid(const TwistBound& bound, const TimeInterval& interval, const char* what);

/// A motion made of the caller's functions. Proofs are only as good as `twist_bound`: each function
/// must meet the contract of the member of Motion with its name, also when called from several
/// threads at once, and poses must round as the default Motion::pose_scale() states. check_motion()
/// tests all this.
class UserMotion final : public Motion {
 public:
  struct Functions {
    std::function<RigidPose(Scalar)> pose;
    std::function<Twist(Scalar)> twist;
    std::function<TwistBound(const TimeInterval&)> twist_bound;
    std::function<Scalar(Scalar)> smooth_until;  ///< empty: no jumps within the domain
  };

  /// @throws InvalidArgument if one of the first three functions is empty, or the domain is
  ///         reversed or NaN; its ends may be infinite.
  explicit UserMotion(Functions functions, const TimeInterval& domain = {-kInfinity, kInfinity});

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;

  /// @throws InvalidArgument if the function returned a negative number or NaN.
  TwistBound twist_bound(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return domain_; }

  /// @throws InvalidArgument if the function returned a time that is not after t.
  Scalar smooth_until(Scalar t) const override;

 private:
  Functions functions_;
  TimeInterval domain_;
};

}  // namespace dyop
