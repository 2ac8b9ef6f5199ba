// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_device.h"

#include <charconv>

#include "dyop/core/error.h"

namespace dyop::cli {

LinkedDevice::LinkedDevice(std::uint16_t port, const ToolScene& scene)
    : link_(port), pose_(scene.X_WT) {
  for (std::size_t k = 0; k < scene.hinges.size(); ++k) pose_.angles[k] = scene.hinges[k].angle;
}

DevicePose LinkedDevice::pose() {
  if (const std::optional<TransformMessage> message = link_.receive()) {
    ++messages_;
    pose_.p_WD = message->pose.translation();
    pose_.q_WD = message->pose.quaternion();
  }
  return pose_;
}

LinkedOutput::LinkedOutput(const std::string& receiver) {
  const std::size_t colon = receiver.rfind(':');
  const char* end = receiver.data() + receiver.size();
  const auto [stop, error] = colon == std::string::npos
                                 ? std::from_chars_result{end, std::errc::invalid_argument}
                                 : std::from_chars(receiver.data() + colon + 1, end, port_);
  DYOP_REQUIRE(error == std::errc{} && stop == end && port_ > 0,
               "--send: expected ADDRESS:PORT, not '", receiver, "'");
  address_ = receiver.substr(0, colon);
  link_.send(address_, port_, {"Tool", RigidPose()});  // throws for an address that is none
}

void LinkedOutput::send(const ToolTick& tick) {
  link_.send(address_, port_, {"Tool", tick.tool.X_WT});
  link_.send(address_, port_, {"Force", RigidPose(tick.wrench.force_W)});
}

}  // namespace dyop::cli
