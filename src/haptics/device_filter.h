// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/haptics/haptic_session.h"
#include "haptics/tool_body.h"

namespace dyop::haptics_internal {

/// Decides which poses of a device the tool may be asked to follow.
class DeviceFilter {
 public:
  /// @param reach No point of the tool is farther from its origin.
  DeviceFilter(const HapticOptions& options, Scalar reach);

  enum class Verdict {
    Usable,
    Moved,    ///< usable, but the hand has not moved the device there
    Outlier,  ///< farther from the last one than a hand moves, and from the one before
    Invalid,
  };
  /// Forgets all poses.
  void reset();
  /// Judges the pose of a tick and keeps it as goal() if it is usable.
  Verdict judge(const DevicePose& device, Scalar dt);

  /// The last usable pose.
  const std::optional<ToolPose>& goal() const { return goal_; }

 private:
  std::optional<ToolPose> checked(const DevicePose& device) const;
  bool is_within_reach(const ToolPose& from, const ToolPose& to, Scalar time) const;

  const Scalar largest_coordinate_;
  const Scalar largest_speed_;
  const Scalar reach_;
  std::optional<ToolPose> goal_;
  std::optional<ToolPose> doubted_;  // the last outlier
  Scalar goal_age_ = 0;
  Scalar doubted_age_ = 0;
};

/// The largest coordinate in a session, length: beyond it rounding is no longer small against the
/// rest offset, and no gap can be proven.
Scalar largest_coordinate(const HapticOptions& options);

}  // namespace dyop::haptics_internal
