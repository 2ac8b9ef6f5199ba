// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "dyop/haptics/haptic_runner.h"
#include "dyop/io/haptic_scene_file.h"
#include "dyop/io/transform_stream.h"

namespace dyop::cli {

/// A device that sends its pose as TRANSFORM messages of OpenIGTLink.
class LinkedDevice {
 public:
  /// @param listen Numeric IPv4 address to listen on, of this machine.
  /// @param link PORT: a UDP port to listen on; tcp:PORT: a TCP port; tcp:ADDRESS:PORT: to connect
  /// to, the address a numeric IPv4 one.
  /// @param run, tool For the pose until the first message, the angles of the hinges, and how the
  /// device's motions become the tool's.
  /// @throws InvalidArgument if the link is none of these.
  LinkedDevice(const std::string& link, const std::string& listen, const HapticRun& run,
               const HapticTool& tool);
  ~LinkedDevice();

  /// The pose of the newest message. Messages are read and checked in a thread of their own.
  DevicePose pose();

  /// Over TCP, every tick's result goes back to the device; see LinkedOutput.
  /// @param felt The wrench in the device's axes.
  void answer(const HapticTick& tick, const ToolWrench& felt);

  /// For the user: what it listens on or is connected to.
  const std::string& name() const { return name_; }
  std::int64_t messages() const { return messages_; }

 private:
  void read_messages(const std::stop_token& stop);

  std::optional<TransformLink> datagrams_;
  std::optional<TransformStream> stream_;
  std::string name_;
  DevicePose pose_;
  std::optional<DeviceMapping> mapping_;
  std::int64_t messages_ = 0;
  std::mutex mutex_;  // of the newest message, held for a copy
  std::optional<RigidPose> newest_;
  std::jthread reader_;
};

/// Sends every tick's result in two TRANSFORM datagrams: "Tool" with the tool's pose, and "Force"
/// with the force on the hand in place of a position.
class LinkedOutput {
 public:
  /// @param receiver ADDRESS:PORT, the address a numeric IPv4 one.
  /// @throws InvalidArgument if it is not.
  explicit LinkedOutput(const std::string& receiver);

  /// @param felt The wrench in the device's axes.
  void send(const HapticTick& tick, const ToolWrench& felt);

 private:
  std::string address_;
  std::uint16_t port_ = 0;
  TransformLink link_{0};
};

}  // namespace dyop::cli
