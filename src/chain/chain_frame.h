// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/chain/kinematic_chain.h"
#include "dyop/motion/motion.h"

namespace dyop::chain_internal {

/// Sets the parts of the rotation exp(q axis_P) R_PJ, by Rodrigues' formula.
inline void set_turn(KinematicChain::Step& step) {
  const Matrix3& R = step.X_PJ.rotation();
  step.turn_fixed = step.axis_P * (step.axis_P.transpose() * R);
  step.turn_cosine = R - step.turn_fixed;
  for (int k = 0; k < 3; ++k) step.turn_sine.col(k) = step.axis_P.cross(R.col(k));
}

/// The rotation of a revolute joint, by the cosine and sine of its coordinate.
inline Matrix3 turn_at(const KinematicChain::Step& step, Scalar cosine, Scalar sine) {
  return step.turn_fixed + cosine * step.turn_cosine + sine * step.turn_sine;
}

/// The pose of a child link in its parent's frame.
inline RigidPose step_pose(const KinematicChain::Step& step, Scalar q) {
  switch (step.type) {
    case JointType::Fixed:
      break;
    case JointType::Revolute:
      return RigidPose::from_trusted(turn_at(step, std::cos(q), std::sin(q)),
                                     step.X_PJ.translation());
    case JointType::Prismatic:
      return RigidPose::from_trusted(step.X_PJ.rotation(),
                                     step.X_PJ.translation() + q * step.axis_P);
  }
  return step.X_PJ;
}

/// A link's frame on the way from the base to the tip, and how it moves.
struct ChainFrame {
  Matrix3 R = Matrix3::Identity();
  Vector3 p = Vector3::Zero();
  Twist twist;
};

/// A coordinate at one time; the sine and cosine are those of a revolute joint's value.
struct JointInstant {
  Scalar value = 0;
  Scalar rate = 0;
  Scalar cosine = 1;
  Scalar sine = 0;
};

inline JointInstant joint_instant(const JointPath& path, std::size_t coordinate, std::size_t piece,
                                  Scalar t) {
  const JointPath::Sample q = path.sample(coordinate, piece, t);
  return {q.value, q.rate, std::cos(q.value), std::sin(q.value)};
}

/// Past one more joint, towards the tip.
inline void advance(ChainFrame& frame, const KinematicChain::Step& step, const JointInstant& q) {
  const Vector3 axis = frame.R * step.axis_P;
  const bool is_prismatic = step.type == JointType::Prismatic;
  const Vector3 shift_P = is_prismatic ? Vector3(step.X_PJ.translation() + q.value * step.axis_P)
                                       : step.X_PJ.translation();
  const Vector3 shift = frame.R * shift_P;
  frame.p += shift;
  frame.twist.v_WB += frame.twist.w_WB.cross(shift);
  if (is_prismatic) {
    frame.twist.v_WB += q.rate * axis;
    frame.R = frame.R * step.X_PJ.rotation();
  } else {
    frame.twist.w_WB += q.rate * axis;
    frame.R = frame.R * turn_at(step, q.cosine, q.sine);
  }
}

/// A product of many rotations, with the rounding errors of its columns' lengths and angles
/// removed.
inline Matrix3 orthonormal(const Matrix3& R) {
  Matrix3 result;
  result.col(0) = R.col(0).normalized();
  result.col(1) = (R.col(1) - result.col(0) * result.col(0).dot(R.col(1))).normalized();
  result.col(2) = result.col(0).cross(result.col(1));
  return result;
}

/// The link at the end: behind the last joint by fixed ones, X_JL.
inline MotionState link_state(const ChainFrame& frame, const RigidPose& X_JL) {
  const Vector3 shift = frame.R * X_JL.translation();
  return {RigidPose::from_trusted(orthonormal(frame.R * X_JL.rotation()), frame.p + shift),
          {frame.twist.v_WB + frame.twist.w_WB.cross(shift), frame.twist.w_WB}};
}

}  // namespace dyop::chain_internal
