#pragma once

#include <algorithm>
#include <cmath>

#include "dyop/core/tolerance.h"
#include "dyop/motion/motion.h"

namespace dyop::internal {

/// How far R^T R is from the identity, the largest entry; NaN or infinite if an entry of R is.
inline Scalar rotation_error(const Matrix3& R) {
  const auto x = R.col(0);
  const auto y = R.col(1);
  const auto z = R.col(2);
  const Scalar lengths = std::abs(x.dot(x) - 1) + std::abs(y.dot(y) - 1) + std::abs(z.dot(z) - 1);
  // A sum, not a maximum, so that NaN survives.
  return lengths + std::abs(x.dot(y)) + std::abs(y.dot(z)) + std::abs(z.dot(x));
}

/// Finite, orthonormal up to kEngineRotationNoise, and no mirror.
inline bool is_rotation(const Matrix3& R) {
  return rotation_error(R) <= kEngineRotationNoise && R.col(0).cross(R.col(1)).dot(R.col(2)) > 0;
}

/// Finite numbers minus themselves are zero, all others NaN.
inline bool is_finite(const Vector3& x) {
  return ((x[0] - x[0]) + (x[1] - x[1])) + (x[2] - x[2]) == 0;
}

inline bool is_sound(const MotionState& state) {
  return is_rotation(state.X_WB.rotation()) && is_finite(state.X_WB.translation()) &&
         is_finite(state.twist.v_WB) && is_finite(state.twist.w_WB);
}

/// Throws InvalidArgument that says what is wrong with a state that is not sound.
[[noreturn]] void refuse(const MotionState& state, Scalar t, const char* what);

/// The one gate through which poses and twists of motions enter the engine.
///
/// @param what Names the motion in messages, such as "the motion of A".
/// @throws InvalidArgument with the time and the value if the pose is not finite or not a rotation,
///         or the twist is not finite; with the time in front if the motion itself throws one.
MotionState guarded_state(const Motion& motion, Scalar t, const char* what);

/// The same for a pose alone.
RigidPose guarded_pose(const Motion& motion, Scalar t, const char* what);

/// Two times and the poses at them, as the engine met them.
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
/// on speed allows: a motion that jumps from one place to another.
inline void require_no_jump(const PoseStep& step, const TwistBound& bound, Scalar radius,
                            Scalar noise, const char* what) {
  const Scalar speed = bound.linear_speed + bound.angular_speed * radius;
  const Scalar moved = std::max((step.p_to - step.p_from).cwiseAbs().maxCoeff(),
                                (step.R_to - step.R_from).cwiseAbs().maxCoeff() * radius);
  // False for infinite bounds times zero, which is NaN.
  if (moved > speed * std::abs(step.t_to - step.t_from) + noise) [[unlikely]] {
    refuse_jump(step, speed, what);
  }
}

}  // namespace dyop::internal
