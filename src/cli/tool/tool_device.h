// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dyop/tool/tool_runner.h"
#include "dyop/tool_io/transform_link.h"

namespace dyop::cli {

/// A device that sends its pose as TRANSFORM datagrams of OpenIGTLink.
class LinkedDevice {
 public:
  /// @param scene For the pose until the first message, and the angles of the hinges.
  LinkedDevice(std::uint16_t port, const ToolScene& scene);

  /// The pose of the newest message.
  DevicePose pose();
  std::uint16_t port() const { return link_.port(); }
  std::int64_t messages() const { return messages_; }

 private:
  TransformLink link_;
  DevicePose pose_;
  std::int64_t messages_ = 0;
};

/// Sends every tick's result in two TRANSFORM datagrams: "Tool" with the tool's pose, and "Force"
/// with the force on the hand in place of a position.
class LinkedOutput {
 public:
  /// @param receiver ADDRESS:PORT, the address a numeric IPv4 one.
  /// @throws InvalidArgument if it is not.
  explicit LinkedOutput(const std::string& receiver);

  void send(const ToolTick& tick);

 private:
  std::string address_;
  std::uint16_t port_ = 0;
  TransformLink link_{0};
};

}  // namespace dyop::cli
