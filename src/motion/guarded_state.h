// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/motion/motion.h"

namespace dyop::motion_internal {

/// How far a matrix with columns x, y, z is from a rotation: x and y have length one and are
/// perpendicular, and z is x cross y. A sum, so that NaN survives; 0 up to rounding.
inline Scalar rotation_error(const Matrix3& R) {
  const Scalar* r = R.data();  // by columns
  const Scalar xx = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] - 1;
  const Scalar yy = r[3] * r[3] + r[4] * r[4] + r[5] * r[5] - 1;
  const Scalar xy = r[0] * r[3] + r[1] * r[4] + r[2] * r[5];
  const Scalar z0 = r[1] * r[5] - r[2] * r[4] - r[6];
  const Scalar z1 = r[2] * r[3] - r[0] * r[5] - r[7];
  const Scalar z2 = r[0] * r[4] - r[1] * r[3] - r[8];
  return std::abs(xx) + std::abs(yy) + std::abs(xy) + std::abs(z0) + std::abs(z1) + std::abs(z2);
}

/// Orthonormal up to kEngineRotationNoise, and not a mirror; false for NaN.
inline bool is_rotation(const Matrix3& R) {
  return rotation_error(R) <= kEngineRotationNoise;
}

/// Finite numbers minus themselves are zero, all others NaN.
inline bool is_finite(const Vector3& x) {
  return ((x[0] - x[0]) + (x[1] - x[1])) + (x[2] - x[2]) == 0;
}

inline bool is_finite(const MotionState& state) {
  const Vector3& p = state.X_WB.translation();
  const Vector3& v = state.twist.v_WB;
  const Vector3& w = state.twist.w_WB;
  // One comparison for all nine numbers.
  return ((p[0] - p[0]) + (p[1] - p[1]) + (p[2] - p[2])) +
             ((v[0] - v[0]) + (v[1] - v[1]) + (v[2] - v[2])) +
             ((w[0] - w[0]) + (w[1] - w[1]) + (w[2] - w[2])) ==
         0;
}

/// Throws InvalidArgument that tells what is wrong with an unsound state.
[[noreturn]] void refuse(const MotionState& state, Scalar t, const char* what);

/// guarded_state() of a motion that is not trusted, but for the test for finite numbers.
MotionState checked_state(const Motion& motion, Scalar t, const char* what);

/// The only gate through which poses and twists of motions enter the engine.
///
/// @param is_trusted The motion's Motion::is_trusted(): only finite numbers are asked for.
/// @param what       Names the motion in messages, such as "the motion of A".
/// @throws InvalidArgument with the time and the value if the pose is not finite or not a rotation,
///         or the twist is not finite; one that an untrusted motion throws, prefixed with the time.
inline MotionState guarded_state(const Motion& motion, bool is_trusted, Scalar t,
                                 const char* what) {
  MotionState state = is_trusted ? motion.state(t) : checked_state(motion, t, what);
  if (!is_finite(state)) [[unlikely]]
    refuse(state, t, what);
  return state;
}

/// The same for a pose alone.
RigidPose guarded_pose(const Motion& motion, Scalar t, const char* what);

/// Two times and the poses at them, as the engine got them.
struct PoseStep {
  const Matrix3& R_from;
  const Vector3& p_from;
  const Matrix3& R_to;
  const Vector3& p_to;
  Scalar t_from;
  Scalar t_to;
};

/// Throws InvalidArgument that names the motion.
[[noreturn]] void refuse_jump(const PoseStep& step, Scalar speed, const char* what);

/// Throws InvalidArgument if a body of this radius moves farther between two times than its bound
/// on speed allows: the motion jumps from one place to another.
inline void require_no_jump(const PoseStep& step, const TwistBound& bound, Scalar radius,
                            Scalar noise, const char* what) {
  const Scalar speed = bound.linear_speed + bound.angular_speed * radius;
  const Scalar* from = step.R_from.data();
  const Scalar* to = step.R_to.data();
  Scalar turned = 0;  // of two columns, from which the third follows
  for (int i = 0; i < 6; ++i) turned = std::max(turned, std::abs(to[i] - from[i]));
  const Scalar moved = std::max((step.p_to - step.p_from).cwiseAbs().maxCoeff(), turned * radius);
  // False for infinite bounds times zero, which is NaN.
  if (moved > speed * std::abs(step.t_to - step.t_from) + noise) [[unlikely]] {
    refuse_jump(step, speed, what);
  }
}

/// Poses whose rotation_error() is above this part of kEngineRotationNoise are restored.
inline constexpr Scalar kRestoredFraction = 1.0 / 3;

/// The pose with a rotation whose rotation_error() is at most kRestoredFraction *
/// kEngineRotationNoise = 32u. The quaternion of RigidPose's constructor leaves up to 73u (of 2e7
/// rotations); this leaves at most 27u: 10u in each length (3u in the sum of squares, half of it in
/// the root, then the root, the division, and what rotation_error() rounds), 7u between x and y,
/// and none in z, which is computed as there.
/// @throws InvalidArgument as RigidPose's constructor, if the rotation is too far from one.
inline RigidPose restored(const RigidPose& X_WB) {
  Matrix3 R = RigidPose(X_WB.rotation(), X_WB.translation()).rotation();
  R.col(0) /= std::sqrt(R.col(0).squaredNorm());
  R.col(1) -= R.col(0).dot(R.col(1)) * R.col(0);
  R.col(1) /= std::sqrt(R.col(1).squaredNorm());
  R.col(2) = R.col(0).cross(R.col(1));
  return RigidPose::from_trusted(R, X_WB.translation());
}

/// Restores the rotation of a pose that is the product of many, long before a query would refuse
/// it. What was restored once keeps its bits, so that a recorded motion is built again as it was.
inline RigidPose without_drift(const RigidPose& X_WB) {
  const Scalar most = kRestoredFraction * kEngineRotationNoise;
  return rotation_error(X_WB.rotation()) <= most ? X_WB : restored(X_WB);
}

}  // namespace dyop::motion_internal
