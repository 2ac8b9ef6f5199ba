// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_device.h"

#include <charconv>
#include <string_view>

#include "dyop/core/error.h"

namespace dyop::cli {
namespace {

constexpr std::string_view kStream = "tcp:";

// A whole text as a port; nothing if it is none.
std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return port;
}

struct Address {
  std::string host;
  std::uint16_t port = 0;
};

// HOST:PORT; the host is not looked at.
std::optional<Address> address_of(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::optional<std::uint16_t> port = port_of(text.substr(colon + 1));
  if (!port || *port == 0) return std::nullopt;
  return Address{std::string(text.substr(0, colon)), *port};
}

TransformMessage pose_message(const HapticTick& tick) {
  return {"Tool", tick.tool.X_WT};
}

TransformMessage force_message(const HapticTick& tick) {
  return {"Force", RigidPose(tick.wrench.force_W)};
}

}  // namespace

LinkedDevice::LinkedDevice(const std::string& link, const HapticScene& scene) : pose_(scene.X_WT) {
  for (std::size_t k = 0; k < scene.hinges.size(); ++k) pose_.angles[k] = scene.hinges[k].angle;
  const bool is_stream = link.starts_with(kStream);
  const std::string_view place = std::string_view(link).substr(is_stream ? kStream.size() : 0);
  if (const std::optional<std::uint16_t> port = port_of(place)) {
    const std::uint16_t taken =
        is_stream ? stream_.emplace(*port).port() : datagrams_.emplace(*port).port();
    name_ = std::string(is_stream ? "TCP" : "UDP") + " port " + std::to_string(taken);
    return;
  }
  const std::optional<Address> address = is_stream ? address_of(place) : std::nullopt;
  DYOP_REQUIRE(address, "--device: expected PORT, tcp:PORT or tcp:ADDRESS:PORT, not '", link, "'");
  stream_.emplace(address->host, address->port);
  name_ = "TCP " + std::string(place);
}

DevicePose LinkedDevice::pose() {
  if (const auto message = stream_ ? stream_->receive() : datagrams_->receive()) {
    ++messages_;
    pose_.p_WD = message->pose.translation();
    pose_.q_WD = message->pose.quaternion();
  }
  return pose_;
}

void LinkedDevice::answer(const HapticTick& tick) {
  if (!stream_) return;
  stream_->send(pose_message(tick));
  stream_->send(force_message(tick));
}

LinkedOutput::LinkedOutput(const std::string& receiver) {
  const std::optional<Address> address = address_of(receiver);
  DYOP_REQUIRE(address, "--send: expected ADDRESS:PORT, not '", receiver, "'");
  address_ = address->host;
  port_ = address->port;
  link_.send(address_, port_, {"Tool", RigidPose()});  // throws for an address that is none
}

void LinkedOutput::send(const HapticTick& tick) {
  link_.send(address_, port_, pose_message(tick));
  link_.send(address_, port_, force_message(tick));
}

}  // namespace dyop::cli
