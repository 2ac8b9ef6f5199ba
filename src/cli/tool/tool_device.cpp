// SPDX-License-Identifier: BSD-3-Clause
#include "cli/tool/tool_device.h"

#include <charconv>
#include <chrono>
#include <string_view>
#include <utility>

#include "dyop/core/error.h"

namespace dyop::cli {
namespace {

constexpr std::string_view kStream = "tcp:";

// A quarter of a tick of 1 ms.
constexpr std::chrono::microseconds kReadEvery{250};

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

TransformMessage force_message(const ToolWrench& wrench) {
  return {"Force", RigidPose(wrench.force_W)};
}

}  // namespace

LinkedDevice::LinkedDevice(const std::string& link, const std::string& listen, const HapticRun& run,
                           const HapticTool& tool)
    : pose_(tool.X_WT) {
  if (run.mapping) mapping_.emplace(*run.mapping, tool.X_WT);
  pose_.angles = tool.start().angles;
  const bool is_stream = link.starts_with(kStream);
  const std::string_view place = std::string_view(link).substr(is_stream ? kStream.size() : 0);
  if (const std::optional<std::uint16_t> port = port_of(place)) {
    const std::uint16_t taken = is_stream
                                    ? stream_.emplace(TransformStream::Listen{listen, *port}).port()
                                    : datagrams_.emplace(*port, listen).port();
    name_ =
        std::string(is_stream ? "TCP" : "UDP") + " port " + std::to_string(taken) + " of " + listen;
  } else {
    const std::optional<Address> address = is_stream ? address_of(place) : std::nullopt;
    DYOP_REQUIRE(address, "--device: expected PORT, tcp:PORT or tcp:ADDRESS:PORT, not '", link,
                 "'");
    stream_.emplace(address->host, address->port);
    name_ = "TCP " + std::string(place);
  }
  reader_ = std::jthread([this](const std::stop_token& stop) { read_messages(stop); });
}

LinkedDevice::~LinkedDevice() = default;

void LinkedDevice::read_messages(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (const auto message = stream_ ? stream_->receive() : datagrams_->receive()) {
      const std::lock_guard lock(mutex_);
      newest_ = message->pose;
    }
    std::this_thread::sleep_for(kReadEvery);
  }
}

DevicePose LinkedDevice::pose() {
  std::optional<RigidPose> newest;
  {
    const std::lock_guard lock(mutex_);
    newest = std::exchange(newest_, std::nullopt);
  }
  if (newest) {
    ++messages_;
    const DevicePose device(*newest);
    const DevicePose mapped = mapping_ ? mapping_->to_tool(device) : device;
    pose_.p_WD = mapped.p_WD;
    pose_.q_WD = mapped.q_WD;
  }
  return pose_;
}

void LinkedDevice::answer(const HapticTick& tick, const ToolWrench& felt) {
  if (!stream_) return;
  stream_->send(pose_message(tick));
  stream_->send(force_message(felt));
}

LinkedOutput::LinkedOutput(const std::string& receiver) {
  const std::optional<Address> address = address_of(receiver);
  DYOP_REQUIRE(address, "--send: expected ADDRESS:PORT, not '", receiver, "'");
  address_ = address->host;
  port_ = address->port;
  link_.send(address_, port_, {"Tool", RigidPose()});  // throws for an address that is none
}

void LinkedOutput::send(const HapticTick& tick, const ToolWrench& felt) {
  link_.send(address_, port_, pose_message(tick));
  link_.send(address_, port_, force_message(felt));
}

}  // namespace dyop::cli
