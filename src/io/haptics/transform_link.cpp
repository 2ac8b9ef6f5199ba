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

[[noreturn]] void fail(std::uint16_t port, int code) {
  throw FileError("UDP port " + std::to_string(port), std::strerror(code));
}

}  // namespace

TransformLink::TransformLink(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
  if (socket_ < 0) fail(port, errno);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  address.sin_port = htons(port);
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int code = errno;
    ::close(socket_);
    fail(port, code);
  }
}

TransformLink::~TransformLink() {
  ::close(socket_);
}

std::uint16_t TransformLink::port() const {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length) != 0) fail(0, errno);
  return ntohs(address.sin_port);
}

// The system's buffer bounds the number of waiting datagrams, and so the loop.
std::optional<TransformMessage> TransformLink::receive() {
  std::optional<TransformMessage> newest;
  std::array<std::uint8_t, kLongestDatagram> bytes;
  constexpr int kMost = 10'000;
  for (int k = 0; k < kMost; ++k) {
    const auto length = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (length < 0) break;
    auto message = unpack_transform(std::span(bytes).first(std::size_t(length)));
    if (message) newest = std::move(message);
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
  const auto sent = ::sendto(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                             reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  return sent == ssize_t(bytes.size());
}

}  // namespace dyop
