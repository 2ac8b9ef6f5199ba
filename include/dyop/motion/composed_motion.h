// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

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
  /// Composed of a stretch of each, by the formulas above.
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override;
  bool is_trusted() const override { return outer_->is_trusted() && inner_->is_trusted(); }

  const Motion& outer() const { return *outer_; }
  const Motion& inner() const { return *inner_; }

 private:
  std::shared_ptr<const Motion> outer_;
  std::shared_ptr<const Motion> inner_;
};

}  // namespace dyop

namespace dyop::motion_internal {
class ChordTree;
class SpeedTree;
}  // namespace dyop::motion_internal

namespace DYOP_EXPORT dyop {

/// Motions one after another: a robot's program, the pieces of a spline. The pose is continuous;
/// the twist may jump where two parts meet. Immutable.
///
/// Cost: O(log n) on top of the part's own; no allocation.
class SequenceMotion final : public Motion {
 public:
  struct Part {
    TimeInterval interval;                 ///< of the sequence; within the motion's domain
    std::shared_ptr<const Motion> motion;  ///< not null
  };

  /// @throws InvalidArgument unless there is a part, each with an interval of positive, finite
  ///         length on which its motion is defined and that starts where the one before it ends,
  ///         and the poses there agree up to rounding; names the parts and the difference.
  explicit SequenceMotion(std::vector<Part> parts);

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;
  MotionState state(Scalar t) const override;

  /// Accelerations are infinite if two parts meet inside the interval.
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override;
  std::span<const Part> parts() const { return parts_; }

  /// The end of the part, or of a smooth piece within it if that is sooner.
  Scalar smooth_until(Scalar t) const override;

  /// Within a part as the part knows it, and across 2, 4, 8, ... parts at once, if there are eight
  /// or more and all are trusted.
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override;

  /// If all parts are.
  bool is_trusted() const override { return is_trusted_; }

 private:
  std::size_t part_at(Scalar t) const;
  std::vector<Part> parts_;
  std::shared_ptr<const motion_internal::SpeedTree> speeds_;
  std::shared_ptr<const motion_internal::ChordTree> chords_;  // may be null
  PoseScale pose_scale_;                                      // covers all parts
  bool is_trusted_ = true;
  // How much rounding makes the pose jump where parts meet: sums over the meetings before each
  // part, relative to rounding as PoseScale is. Speeds do not bound it.
  std::vector<PoseScale> jumps_;
};

}  // namespace dyop
