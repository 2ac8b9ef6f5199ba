// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::motion_internal {
class ChordTree;
class SpeedTree;
}  // namespace dyop::motion_internal

namespace DYOP_EXPORT dyop {

/// A log of poses at uneven time stamps, say from a haptic device or a robot. Between two stamps
/// the origin moves linearly, and the rotation along the shortest arc at a constant rate. At the
/// stamps the twist jumps; smooth_sampled_motion() avoids that.
///
/// A turn by pi or more between two stamps looks like the shorter one: sample faster.
/// Cost: O(log n) for pose, twist and bound; no allocation.
class SampledMotion final : public Motion {
 public:
  struct Sample {
    Scalar t = 0;
    RigidPose X_WB;
  };

  /// @throws InvalidArgument unless there are two samples or more, with finite, strictly
  ///         increasing stamps, far enough apart for finite velocities; names index and values.
  explicit SampledMotion(std::vector<Sample> samples);

  /// As given.
  std::span<const Sample> samples() const { return samples_; }

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;

  /// Accelerations are infinite if a stamp lies inside the interval, otherwise zero. Speeds are the
  /// largest of all pieces that overlap the interval.
  TwistBound twist_bound(const TimeInterval& interval) const override;
  PoseScale pose_scale(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return {stamps_.front(), stamps_.back()}; }

  /// The next stamp after t, infinity after the last.
  Scalar smooth_until(Scalar t) const override;

  /// Across 2, 4, 8, ... pieces at once, with the constant twist from the first pose to the last.
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override;
  bool is_trusted() const override { return true; }

 private:
  struct Piece {
    SteadyTurn R_WB;
    Twist twist_WB;
  };
  std::size_t piece_at(Scalar t) const;

  std::vector<Sample> samples_;
  std::vector<Scalar> stamps_;  // of the samples, contiguous for searching
  std::vector<Piece> pieces_;
  std::shared_ptr<const motion_internal::SpeedTree> speeds_;
  std::shared_ptr<const motion_internal::ChordTree> chords_;
  PoseScale pose_scale_;
};

/// A log of poses at uneven time stamps, through which the body moves with a continuous twist:
/// cubics in position and rotation vector between stamps (HermiteMotion). The twist at a stamp is
/// that of the parabola through it and its two neighbours; the first and last stamp use the
/// parabola of the stamp next to them. With two samples it is constant.
///
/// A turn by pi or more between two stamps looks like the shorter one: sample faster.
/// @throws InvalidArgument as SampledMotion.
SequenceMotion smooth_sampled_motion(const std::vector<SampledMotion::Sample>& samples);

}  // namespace dyop
