// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/core/rigid_pose.h"
#include "dyop/haptics/haptic_tick.h"

namespace DYOP_EXPORT dyop {

/// How a hand's motions become the tool's.
struct DeviceMappingOptions {
  Matrix3 R_WV = Matrix3::Identity();  ///< from the device's axes V to the world's
  Scalar scale = 1;           ///< tool displacement per displacement of the hand, finite, > 0
  Scalar rotation_scale = 1;  ///< the same for turns; other than 1, turns of a closed path add up
};

/// Motion scaling and clutch: maps a device's pose to the one that HapticSession::update() takes,
/// and the wrench back to the hand, so that the power is the same on both sides:
/// F_h . v_h + t_h . w_h = F . v + t . w. Scaling so creates no energy, and what the hand feels of
/// the springs is scale² as stiff; the device's damping must exceed that bound
/// (least_passive_damping()).
///
/// From one pose with an open clutch to the next the tool's side stands still and the hand feels
/// nothing; once closed, the tool goes on from there, wherever the hand is.
class DeviceMapping {
 public:
  /// @param start Where the tool is for the first pose of the device: HapticScene::X_WT.
  /// @throws InvalidArgument if R_WV is no rotation or a scale is not finite and > 0.
  DeviceMapping(const DeviceMappingOptions& options, const RigidPose& start);

  /// The device's pose for the tool. A pose that is not finite, or no rotation, is handed on as it
  /// is, for the session to refuse, and changes nothing here. Angles and buttons are handed on.
  DevicePose to_tool(const DevicePose& device, bool is_clutch_open = false);
  /// What the hand shall feel of a tick's wrench, in the device's axes V.
  ToolWrench to_hand(const ToolWrench& wrench) const;

  /// The tool is elsewhere: HapticSession::reset().
  void reset(const RigidPose& X_WD);

 private:
  struct Hand {
    Vector3 p_V;
    Matrix3 R_V;
  };

  DeviceMappingOptions options_;
  std::optional<Hand> last_;
  Vector3 p_WD_;
  Matrix3 R_WD_;
  bool is_open_ = false;
};

}  // namespace dyop
