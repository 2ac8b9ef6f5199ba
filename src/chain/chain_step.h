// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "dyop/chain/kinematic_chain.h"

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

}  // namespace dyop::chain_internal
