// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

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

}  // namespace dyop
