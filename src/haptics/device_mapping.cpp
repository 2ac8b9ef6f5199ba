// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/haptics/device_mapping.h"

#include <cmath>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {

DeviceMapping::DeviceMapping(const DeviceMappingOptions& options, const RigidPose& start)
    : options_(options), p_WD_(start.translation()), R_WD_(start.rotation()) {
  const auto require_scale = [](const char* name, Scalar value) {
    DYOP_REQUIRE(value > 0 && value < kInfinity, "DeviceMapping: ", name,
                 " must be finite and > 0, not ", value);
  };
  require_scale("scale", options.scale);
  require_scale("rotation_scale", options.rotation_scale);
  const Matrix3& R = options.R_WV;
  const Scalar error = (R * R.transpose() - Matrix3::Identity()).norm();
  DYOP_REQUIRE(error <= kDeviceRotationTolerance && R.determinant() > 0,
               "DeviceMapping: R_WV must be a rotation; R R^T differs from the identity by ",
               error);
}

// Increments are scaled, not positions: so the clutch only leaves some of them out, and an outlier
// that is followed by its reverse leaves nothing behind. Those count during which the hand felt the
// tool: until the first pose with an open clutch, and from the first one with a closed one.
DevicePose DeviceMapping::to_tool(const DevicePose& device, bool is_clutch_open) {
  DevicePose mapped = device;
  const bool is_sound =
      device.p_WD.allFinite() && std::abs(device.q_WD.norm() - 1) <= kDeviceRotationTolerance;
  if (!is_sound) return mapped;
  const bool was_open = std::exchange(is_open_, is_clutch_open);
  const Hand hand{device.p_WD, device.q_WD.normalized().toRotationMatrix()};
  if (last_ && !was_open) {
    const Matrix3& R_WV = options_.R_WV;
    p_WD_ += options_.scale * (R_WV * (hand.p_V - last_->p_V));
    const Vector3 turn_V = rotation_vector(hand.R_V * last_->R_V.transpose());
    const Matrix3 R_WD = rotation_from_vector(options_.rotation_scale * (R_WV * turn_V)) * R_WD_;
    R_WD_ = Quaternion(R_WD).normalized().toRotationMatrix();
  }
  last_ = hand;
  mapped.p_WD = p_WD_;
  mapped.q_WD = Quaternion(R_WD_);
  return mapped;
}

ToolWrench DeviceMapping::to_hand(const ToolWrench& wrench) const {
  if (is_open_) return {};
  const Matrix3 R_VW = options_.R_WV.transpose();
  return {options_.scale * (R_VW * wrench.force_W),
          options_.rotation_scale * (R_VW * wrench.torque_W)};
}

void DeviceMapping::reset(const RigidPose& X_WD) {
  p_WD_ = X_WD.translation();
  R_WD_ = X_WD.rotation();
}

}  // namespace dyop
