// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// A body B that moves relative to a frame M, which itself moves in the world: X_WB = X_WM X_MB,
/// such as a tool held by a moving arm.
///
/// With q = R_WM p_MB: v = v_M + w_M x q + R_WM v_MB, w = w_M + R_WM w_MB, and
///   |v'| <= a_M + (alpha_M + w_M^2) |q| + 2 w_M v_MB + a_MB,
///   |w'| <= alpha_M + w_M w_MB + alpha_MB.
class ComposedMotion final : public Motion {
 public:
  /// Both are shared and, like every Motion, immutable. Defined where both are.
  /// @throws InvalidArgument if one is null or the domains do not overlap.
  ComposedMotion(std::shared_ptr<const Motion> X_WM, std::shared_ptr<const Motion> X_MB);

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  /// @throws InvalidArgument if the pose of X_MB is not finite or not a rotation in the middle.
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override;
  Scalar smooth_until(Scalar t) const override;
  bool is_trusted() const override { return outer_->is_trusted() && inner_->is_trusted(); }

  const Motion& outer() const { return *outer_; }
  const Motion& inner() const { return *inner_; }

 private:
  std::shared_ptr<const Motion> outer_;
  std::shared_ptr<const Motion> inner_;
};

}  // namespace dyop
