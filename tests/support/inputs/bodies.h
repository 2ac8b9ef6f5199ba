// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/constant_twist_motion.h"

/// Where bodies are and how they move, in few words.
namespace dyop::testing {

/// Moved, not turned.
inline RigidPose at(Scalar x, Scalar y, Scalar z) {
  return RigidPose(Vector3(x, y, z));
}

/// From the pose on, with the velocity v and the angular velocity w.
inline ConstantTwistMotion moving(const RigidPose& X_WB, const Vector3& v,
                                  const Vector3& w = Vector3::Zero()) {
  return ConstantTwistMotion(X_WB, Twist{v, w});
}

}  // namespace dyop::testing
