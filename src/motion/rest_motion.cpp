// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/rest_motion.h"

namespace dyop {

RigidPose RestMotion::pose(Scalar) const {
  return X_WB_;
}

Twist RestMotion::twist(Scalar) const {
  return {};
}

TwistBound RestMotion::twist_bound(const TimeInterval&) const {
  return {};
}

}  // namespace dyop
