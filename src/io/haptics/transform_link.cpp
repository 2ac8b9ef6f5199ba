// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/transform_link.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"

namespace dyop {
namespace {

// Larger than any message; longer datagrams are ignored.
constexpr std::size_t kLongestDatagram = 256;

// Read in one call: some 0.2 ms.
constexpr int kMostDatagrams = 256;

// A peer that has been silent for so long may be replaced by another.
constexpr std::chrono::seconds kSilence{2};

[[noreturn]] void fail(const std::string& address, std::uint16_t port, int code) {
  throw FileError("UDP " + address + ":" + std::to_string(port), std::strerror(code));
}

}  // namespace

TransformLink::TransformLink(std::uint16_t port, const std::string& address) {
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(port);
  DYOP_REQUIRE(::inet_pton(AF_INET, address.c_str(), &place.sin_addr) == 1,
               "expected a numeric IPv4 address, not '", address, "'");
  socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  sending_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  const bool is_open =
      socket_ >= 0 && sending_ >= 0 &&
      ::bind(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof(place)) == 0;
  if (is_open) return;
  const int code = errno;
  if (socket_ >= 0) ::close(socket_);
  if (sending_ >= 0) ::close(sending_);
  fail(address, port, code);
}

TransformLink::~TransformLink() {
  ::close(socket_);
  ::close(sending_);
}

std::uint16_t TransformLink::port() const {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    fail("", 0, errno);
  }
  return ntohs(address.sin_port);
}

// Whether the sender is the peer, or there is none.
bool TransformLink::is_heard(const Peer& sender) {
  const bool is_peer = peer_ && peer_->address == sender.address && peer_->port == sender.port;
  return is_peer || !peer_ || sender.heard - peer_->heard > kSilence;
}

// The number of datagrams read bounds the loop: a flood is not waited out.
std::optional<TransformMessage> TransformLink::receive() {
  std::optional<TransformMessage> newest;
  std::array<std::uint8_t, kLongestDatagram> bytes;
  const auto now = std::chrono::steady_clock::now();
  for (int k = 0; k < kMostDatagrams; ++k) {
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    const auto length = ::recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC,
                                   reinterpret_cast<sockaddr*>(&from), &size);
    if (length < 0) break;
    const Peer sender{from.sin_addr.s_addr, from.sin_port, now};
    if (std::size_t(length) > bytes.size() || !is_heard(sender)) continue;
    auto message = unpack_transform(std::span(bytes).first(std::size_t(length)));
    if (!message) continue;
    newest = std::move(message);
    peer_ = sender;
  }
  return newest;
}

bool TransformLink::send(const std::string& address, std::uint16_t port,
                         const TransformMessage& message) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  DYOP_REQUIRE(::inet_pton(AF_INET, address.c_str(), &to.sin_addr) == 1,
               "a transform can be sent to a numeric IPv4 address, not to '", address, "'");
  const std::vector<std::uint8_t> bytes = pack_transform(message);
  const auto sent = ::sendto(sending_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                             reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  return sent == ssize_t(bytes.size());
}

}  // namespace dyop
