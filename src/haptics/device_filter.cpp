// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/device_filter.h"

#include <cmath>

#include "core/tolerance.h"

namespace dyop::haptics_internal {
namespace {

// Rounding of a pose may be this fraction of the rest offset.
constexpr Scalar kNoiseShare = 0x1p-6;

// Radians; no hinge turns that far, and pi loses its digits in larger angles.
constexpr Scalar kLargestAngle = 1e4;

}  // namespace

Scalar largest_coordinate(const HapticOptions& options) {
  return kNoiseShare * options.rest_offset / kStepNoise;
}

DeviceFilter::DeviceFilter(const HapticOptions& options, Scalar reach)
    : largest_coordinate_(largest_coordinate(options)),
      largest_speed_(options.largest_device_speed),
      reach_(reach) {}

// Devices send quaternions in single precision.
std::optional<ToolPose> DeviceFilter::checked(const DevicePose& device) const {
  const bool is_sound = device.p_WD.allFinite() &&
                        device.p_WD.cwiseAbs().maxCoeff() <= largest_coordinate_ &&
                        std::abs(device.q_WD.norm() - 1) <= kDeviceRotationTolerance;
  if (!is_sound) return std::nullopt;
  ToolPose pose{RigidPose(device.q_WD.normalized(), device.p_WD), device.angles};
  for (const Scalar angle : pose.angles) {
    if (!(std::abs(angle) <= kLargestAngle)) return std::nullopt;
  }
  return pose;
}

bool DeviceFilter::is_within_reach(const ToolPose& from, const ToolPose& to, Scalar time) const {
  const ToolStep step = step_between(from, to);
  return step.v_W.norm() + reach_ * step.w_W.norm() <= largest_speed_ * time;
}

void DeviceFilter::reset() {
  goal_.reset();
  doubted_.reset();
  goal_age_ = doubted_age_ = 0;
}

DeviceFilter::Verdict DeviceFilter::judge(const DevicePose& device, Scalar dt) {
  const std::optional<ToolPose> pose = checked(device);
  if (!(dt >= 0 && dt < kInfinity)) return Verdict::Invalid;
  goal_age_ += dt;
  doubted_age_ += dt;
  if (!pose) return Verdict::Invalid;
  const bool is_near =
      !goal_ || largest_speed_ == kInfinity || is_within_reach(*goal_, *pose, goal_age_);
  const bool is_confirmed = doubted_ && is_within_reach(*doubted_, *pose, doubted_age_);
  if (!is_near && !is_confirmed) {
    doubted_ = pose;
    doubted_age_ = 0;
    return Verdict::Outlier;
  }
  goal_ = pose;
  goal_age_ = 0;
  doubted_.reset();
  return is_near ? Verdict::Usable : Verdict::Moved;
}

}  // namespace dyop::haptics_internal
